//! Culls a file or a world from each of its cameras: time, instances found, instances truly seen.
//!
//! ```sh
//! cargo run --release -p hither-bench --example cull_scene -- FILE|world:SPEC WIDTH HEIGHT [sampled] [coherence] [coarse=N]
//!     [moving] [margin=MM] [occluder=PX] [piece=PX] [face=PX] [pays=FACES] [frames=N] [samples=N] [exact] [ideal=N] [away=KM] [camera=NAME]
//! ```
//!
//! Moving, the eye goes and turns as one who walks at 1.5 m/s and looks around at 30°/s does in 30 frames a second,
//! forwards and to the left; the last frame's is the camera's own. The margin is how far, millimetres, the eye may move
//! while the answer stays true; then what is seen at pixels' centres from fourteen eyes at that distance counts as missing, too.
//!
//! The second line's others are the thresholds of [`CullOptions`], how many frames are timed, samples a pixel each way (4; 0
//! for none), whether to compare with exact visibility, too, and with an ideal image, how far to the north-east all of it is
//! moved beforehand, and the only camera.
//!
//! *Seen* are the instances that are nearest at a pixel's centre, and at one of 4×4 samples a pixel; exactly those of
//! which `hidden_line` finds a visible face or line (it takes all surfaces for double-sided). An ideal image, made of N×N
//! samples a pixel, holds in each pixel the farthest that is seen there: no image of so many pixels can hide more. It is
//! asked about boxes around instances, and of those that show about each triangle.

use glam::{DAffine3, DVec2, DVec3};
use hither::conventions::{Projection, View};
use hither::cull::{CullOptions, Culler, Meaning};
use hither::hidden_line::{Drawing, FaceColor, LineOptions, Preparation, PrepareOptions};
use hither::scene::Transform;
use hither::{IndexOptions, RenderOptions, Scene, SceneIndex, render};
use std::collections::HashSet;
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, or: u32| arguments.get(i).and_then(|s| s.parse().ok()).unwrap_or(or);
    let name = arguments.first().ok_or("which scene?")?;
    let mut scene = match name.strip_prefix("world:") {
        Some(spec) => hither_worlds::generate(spec)?,
        None => hither_io::read(std::path::Path::new(name))?.scene,
    };
    let size = (number(1, 1920), number(2, 1080));
    let number_of = |name: &str, or: u32| number_of(&arguments, name, or);
    let options = options(&arguments)?;
    move_away(&mut scene, f64::from(number_of("away", 0)?) * 1000.0);
    let sampled = options.meaning == Meaning::Sampled;
    let (samples, frames) = (number_of("samples", 4)?, number_of("frames", 30)?);
    let is_moving = arguments.iter().any(|a| a == "moving");
    let only = arguments.iter().find_map(|a| a.strip_prefix("camera="));
    let index = SceneIndex::build(scene, &IndexOptions::default());
    let ideal_by = number_of("ideal", 0)?;
    let exactly = arguments.iter().any(|a| a == "exact");
    let preparation = exactly.then(|| Preparation::new(index.scene(), &PrepareOptions::default()));
    let mut culler = Culler::new();
    culler.prepare(&index);
    println!(
        "{:14} {:>8} {:>8} {:>8} {:>8} {:>8}  missing",
        "camera", "ms", "least", "visible", "seen", "4x4"
    );
    for camera in 0..index.scene().cameras.len() {
        if only.is_some_and(|name| index.scene().cameras[camera].name != name) {
            continue;
        }
        let view = index.scene().view(camera, size).ok_or("no camera")?;
        let mut times = Vec::new();
        let mut found = Default::default();
        for frame in (0..frames).rev() {
            let before = if is_moving { f64::from(frame) } else { 0.0 };
            let view = earlier(&view, before);
            let start = Instant::now();
            found = culler.cull(&index, &view, &options)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        let (at_centres, finer) = match samples {
            0 => Default::default(),
            side => (seen(&index, &view, 1)?, seen(&index, &view, side)?),
        };
        let visible: HashSet<u32> = found.visible.iter().copied().collect();
        let mut truth = if sampled { at_centres.clone() } else { finer.clone() };
        if samples > 0 && options.eye_moves > 0.0 {
            for moved in about(&view, options.eye_moves) {
                truth.extend(seen(&index, &moved, 1)?);
            }
        }
        println!(
            "{:14} {:8.2} {:8.2} {:8} {:8} {:8}  {}; {:?}",
            index.scene().cameras[camera].name,
            times[times.len() / 2],
            times[0],
            visible.len(),
            at_centres.len(),
            finer.len(),
            truth.difference(&visible).count(),
            found.counters
        );
        if let Some(preparation) = &preparation {
            compare_exactly(preparation, &view, &visible)?;
        }
        compare_with_ideal(&index, &view, ideal_by)?;
    }
    Ok(())
}

/// Moves the root group's nodes, and cameras that follow none, so many metres along x and against z.
fn move_away(scene: &mut Scene, metres: f64) {
    if metres == 0.0 {
        return;
    }
    let offset = DAffine3::from_translation(DVec3::new(metres, 0.0, -metres));
    let root = scene.root as usize;
    let nodes = scene.groups[root].nodes.iter_mut().filter(|node| node.parent.is_none());
    let cameras = scene.cameras.iter_mut().filter(|camera| camera.node.is_none());
    for local in nodes.map(|node| &mut node.local).chain(cameras.map(|camera| &mut camera.local)) {
        *local = Transform::Affine(offset * local.matrix());
    }
}

/// Views from fourteen eyes that are as far from that of `view` as may be: along the axes, and between them.
fn about(view: &View, distance: f64) -> Vec<View> {
    let steps = (0..27).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) - 1.0);
    let steps = steps.filter(|step| step.length_squared() != 2.0 && *step != DVec3::ZERO);
    let at = |step: DVec3| DAffine3::from_translation(step.normalize() * distance) * view.view_from_world;
    steps.map(|step| View { view_from_world: at(step), ..*view }).collect()
}

/// A view of so many frames ago.
fn earlier(view: &View, frames: f64) -> View {
    let turn = DAffine3::from_rotation_y((-frames).to_radians());
    let step = DAffine3::from_translation(DVec3::Z * (-0.05 * frames));
    View { view_from_world: turn * step * view.view_from_world, ..*view }
}

fn number_of(arguments: &[String], name: &str, or: u32) -> Result<u32, std::num::ParseIntError> {
    let value = arguments.iter().find_map(|a| a.strip_prefix(name)?.strip_prefix('='));
    value.map_or(Ok(or), str::parse)
}

fn options(arguments: &[String]) -> Result<CullOptions, std::num::ParseIntError> {
    let is_said = |name: &str| arguments.iter().any(|a| a == name);
    let number_of = |name: &str, or: u32| number_of(arguments, name, or);
    let default = CullOptions::default();
    Ok(CullOptions {
        eye_moves: f64::from(number_of("margin", 0)?) * 0.001,
        meaning: if is_said("sampled") { Meaning::Sampled } else { Meaning::Continuous },
        coherence: is_said("coherence"),
        coarseness: match number_of("coarse", 0)? {
            0 => None,
            n => Some(n),
        },
        least_occluder_px: number_of("occluder", default.least_occluder_px)?,
        least_piece_px: number_of("piece", default.least_piece_px)?,
        least_px_a_face: number_of("face", default.least_px_a_face)?,
        faces_a_hidden_box: number_of("pays", default.faces_a_hidden_box)?,
        ..default
    })
}

/// Prints what an exact drawing shows, and how much of that was not found.
fn compare_exactly(
    preparation: &Preparation,
    view: &View,
    found: &HashSet<u32>,
) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let options = LineOptions { faces: Some(FaceColor::White), ..LineOptions::default() };
    let [faces, all] = shown(&preparation.draw(view, &options)?);
    println!(
        "  exactly {} by faces, {} with lines ({:.1} s); missing {} and {}",
        faces.len(),
        all.len(),
        start.elapsed().as_secs_f64(),
        faces.difference(found).count(),
        all.difference(found).count()
    );
    Ok(())
}

/// Prints what an ideal image shows, made of so many samples a pixel each way; of none, nothing.
fn compare_with_ideal(index: &SceneIndex, view: &View, side: u32) -> Result<(), Box<dyn Error>> {
    if side > 0 {
        let [boxes, triangles] = Ideal::new(index, view, side)?.shown(index.scene());
        println!("  an ideal image shows {boxes} by their boxes, {triangles} by their triangles");
    }
    Ok(())
}

/// Instances that are nearest at one of `side` × `side` samples a pixel.
fn seen(index: &SceneIndex, view: &View, side: u32) -> Result<HashSet<u32>, Box<dyn Error>> {
    let fine = View { width: view.width * side, height: view.height * side, ..*view };
    let frame = render(index, &fine, &RenderOptions::default())?;
    let pixels = (0..fine.height).flat_map(|y| (0..fine.width).map(move |x| (x, y)));
    Ok(pixels.filter_map(|(x, y)| frame.id(x, y)).map(|id| id.instance).collect())
}

/// Instances with a visible face, and with a visible face or line.
fn shown(drawing: &Drawing) -> [HashSet<u32>; 2] {
    let faces: HashSet<u32> = drawing.faces.iter().map(|face| face.part).collect();
    let lines = drawing.strokes.iter().filter(|stroke| stroke.covers == 0).map(|stroke| stroke.part);
    let all = faces.iter().copied().chain(lines).collect();
    [faces, all]
}

/// In each pixel the least depth of what is seen there.
struct Ideal {
    view: View,
    least: Vec<f32>,
}

impl Ideal {
    fn new(index: &SceneIndex, view: &View, side: u32) -> Result<Ideal, Box<dyn Error>> {
        let fine = View { width: view.width * side, height: view.height * side, ..*view };
        let frame = render(index, &fine, &RenderOptions::default())?;
        let mut least = vec![f32::INFINITY; (view.width * view.height) as usize];
        for y in 0..fine.height {
            for x in 0..fine.width {
                let pixel = &mut least[(y / side * view.width + x / side) as usize];
                *pixel = pixel.min(frame.depth(x, y));
            }
        }
        Ok(Ideal { view: *view, least })
    }

    /// How many instances show by the boxes around them, and by their triangles, too.
    fn shown(&self, scene: &Scene) -> [usize; 2] {
        let mut counts = [0; 2];
        for instance in scene.instances() {
            let (mesh, at) = (&scene.meshes[instance.mesh as usize], instance.world_from_mesh);
            let bounds = mesh.bounds();
            let corner = |k: usize| DVec3::from([0, 1, 2].map(|i| [bounds.min, bounds.max][k >> i & 1][i]));
            if !self.shows((0..8).map(|k| at.transform_point3(corner(k)))) {
                continue;
            }
            counts[0] += 1;
            let points: Vec<DVec3> =
                mesh.positions.iter().map(|p| at.transform_point3(p.as_dvec3())).collect();
            let shows = |t: &[u32; 3]| self.shows(t.map(|corner| points[corner as usize]).into_iter());
            counts[1] += usize::from(mesh.triangles.iter().any(shows));
        }
        counts
    }

    /// Whether the rectangle around points is somewhere farther than the nearest of them. In perspective.
    fn shows(&self, points: impl Iterator<Item = DVec3>) -> bool {
        let Projection::Perspective { near, .. } = self.view.projection else { return true };
        let half = DVec2::new(self.view.width.into(), self.view.height.into()) * 0.5;
        let (mut low, mut high, mut nearest, mut beyond) =
            (DVec2::INFINITY, DVec2::NEG_INFINITY, f64::INFINITY, [true; 5]);
        for point in points {
            let p = self.view.view_from_world.transform_point3(point);
            let q = DVec2::new(p.x, -p.y) * self.view.pixels_per_unit();
            let border = half * -p.z;
            let outside = [q.x < -border.x, q.x > border.x, q.y < -border.y, q.y > border.y, -p.z <= near];
            beyond.iter_mut().zip(outside).for_each(|(all, this)| *all &= this);
            let on_image = q / -p.z + half;
            (low, high, nearest) = (low.min(on_image), high.max(on_image), f64::min(nearest, -p.z));
        }
        if beyond.contains(&true) {
            return false;
        }
        if nearest <= near {
            return true;
        }
        let pixel = |v: f64, size: u32| (v.max(0.0) as u32).min(size - 1);
        let columns = pixel(low.x, self.view.width)..=pixel(high.x, self.view.width);
        let mut rows = pixel(low.y, self.view.height)..=pixel(high.y, self.view.height);
        // What is seen is not hidden by itself.
        let depth = (near / nearest * (1.0 - 1e-4)) as f32;
        rows.any(|y| columns.clone().any(|x| self.least[(y * self.view.width + x) as usize] < depth))
    }
}
