//! Ray casters that answer the same question by other means: which triangle is seen at each pixel's centre,
//! and how far away along the view axis.
//!
//! They are set up as their makers advise and as fast as they go: the best tree they build, rays in packets
//! where they have packets, instances as instances. They know neither facing nor holes, so they are compared
//! on scenes whose surfaces are opaque and closed or two-sided; and where surfaces coincide, which one they
//! name is chance, so [`Agreement`] counts equal distances too.

#[cfg(feature = "embree")]
pub mod embree;
pub mod obvhs;
mod rays;

pub use rays::{PACKET_SIDE, Rays};

use glam::DAffine3;
use hither::conventions::{NO_ID, View};
use hither::render::Frame;
use hither::scene::Scene;
use std::time::{Duration, Instant};

/// What a peer found in one picture.
#[derive(Clone, Debug, Default)]
pub struct Sighting {
    /// Width, pixels.
    pub width: u32,
    /// Row by row: the number of the instance, or [`NO_ID`].
    pub instance: Vec<u32>,
    /// Row by row: the number of the triangle, or [`NO_ID`].
    pub triangle: Vec<u32>,
    /// Row by row: distance along the view axis, metres, or +∞.
    pub distance: Vec<f32>,
}

/// How far a peer's picture and ours are the same, as shares of all pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// The same triangle of the same instance, or nothing in both.
    pub same_id: f64,
    /// The same distance to one part in 10,000, or nothing in both.
    pub same_distance: f64,
}

/// A ray caster with a scene in it.
pub trait Peer: Sync {
    /// Its name and version.
    fn name(&self) -> String;

    /// Traces rows `rows` (multiples of [`PACKET_SIDE`], or up to the last row) into `out`, which starts at
    /// the first of them.
    fn trace_rows(&self, rays: &Rays, rows: std::ops::Range<u32>, out: RowsOut<'_>);

    /// Draws one picture on `threads` threads and says how long it took, rays and all.
    fn frame(&self, view: &View, threads: usize, sighting: &mut Sighting) -> Duration {
        let pixels = view.width as usize * view.height as usize;
        sighting.width = view.width;
        sighting.instance.resize(pixels, NO_ID);
        sighting.triangle.resize(pixels, NO_ID);
        sighting.distance.resize(pixels, f32::INFINITY);
        let start = Instant::now();
        let rays = Rays::new(view);
        if threads <= 1 {
            self.trace_rows(&rays, 0..view.height, RowsOut::of(sighting));
        } else {
            self.trace_in_strips(&rays, view, threads, sighting);
        }
        start.elapsed()
    }

    /// Strips of packet rows, taken by the next free thread.
    fn trace_in_strips(&self, rays: &Rays, view: &View, threads: usize, sighting: &mut Sighting) {
        const STRIP_ROWS: u32 = 4 * PACKET_SIDE;
        let strip = (STRIP_ROWS * view.width) as usize;
        let strips = sighting
            .instance
            .chunks_mut(strip)
            .zip(sighting.triangle.chunks_mut(strip))
            .zip(sighting.distance.chunks_mut(strip))
            .map(|((instance, triangle), distance)| RowsOut { instance, triangle, distance });
        let queue = std::sync::Mutex::new(strips.enumerate());
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    loop {
                        let next = queue.lock().expect("no thread panics with the queue").next();
                        let Some((i, out)) = next else { return };
                        let first = i as u32 * STRIP_ROWS;
                        self.trace_rows(rays, first..(first + STRIP_ROWS).min(view.height), out);
                    }
                });
            }
        });
    }
}

/// Where the answers of some rows go.
#[derive(Debug)]
pub struct RowsOut<'a> {
    /// As in [`Sighting`].
    pub instance: &'a mut [u32],
    /// As in [`Sighting`].
    pub triangle: &'a mut [u32],
    /// As in [`Sighting`].
    pub distance: &'a mut [f32],
}

impl<'a> RowsOut<'a> {
    fn of(sighting: &'a mut Sighting) -> RowsOut<'a> {
        RowsOut {
            instance: &mut sighting.instance,
            triangle: &mut sighting.triangle,
            distance: &mut sighting.distance,
        }
    }
}

impl Sighting {
    /// Compares with a frame of the same size.
    pub fn agreement(&self, frame: &Frame) -> Agreement {
        let (mut same_id, mut same_distance) = (0u64, 0u64);
        for (i, &instance) in self.instance.iter().enumerate() {
            let (x, y) = (i as u32 % self.width, i as u32 / self.width);
            let ours = frame.id(x, y).map(|id| (id.instance, id.triangle));
            let theirs = (instance != NO_ID).then_some((instance, self.triangle[i]));
            same_id += u64::from(ours == theirs);
            let (ours, theirs) = (frame.distance(x, y), f64::from(self.distance[i]));
            let close = (ours - theirs).abs() <= 1e-4 * ours;
            same_distance += u64::from(close || (ours.is_infinite() && theirs.is_infinite()));
        }
        let pixels = self.instance.len() as f64;
        Agreement { same_id: same_id as f64 / pixels, same_distance: same_distance as f64 / pixels }
    }
}

/// Every instance of a scene with its mesh and its place; peers keep a list of them.
fn instances(scene: &Scene) -> Vec<(u32, DAffine3)> {
    scene.instances().into_iter().map(|i| (i.mesh, i.world_from_mesh)).collect()
}

/// The mesh of a scene's only instance, if it stands where its vertices say: no instance is needed then.
fn only_mesh_in_place(instances: &[(u32, DAffine3)]) -> Option<u32> {
    match instances {
        [(mesh, at)] if *at == DAffine3::IDENTITY => Some(*mesh),
        _ => None,
    }
}
