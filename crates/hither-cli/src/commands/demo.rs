//! `hither` alone: a walk through an office building of 539 million triangles, pictures of it, and what the
//! hierarchical z-buffer spared, against a plain z-buffer on the same frames in the same run.

mod sheet;
mod summary;

use super::report::Seen;
use crate::console::{self, Verbosity};
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::grouped;
use crate::source;
use hither::conventions::View;
use hither::render::{Algorithm, Counters, Frame, Image, Shader, Shading};
use hither::{IndexOptions, RenderOptions, Renderer, SceneIndex};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const FOLDER: &str = "hither-demo";
const WORLD: &str = "world:office?n=33";
const SIZE: (u32, u32) = (1280, 720);
const WALK_CAMERA: &str = "walk";
/// Cameras that stand still, and the pictures from there.
const STANDPOINTS: [(&str, &str); 2] = [("open", "open.png"), ("outside", "outside.png")];
/// Frames of the walk, spread over its duration.
const FRAMES: u32 = 96;
/// Every how many frames of the walk a picture is written.
const PICTURE_EVERY: u32 = 32;
/// The frames that a plain z-buffer draws, too: the longest view, and one after the turn.
const COMPARED: [u32; 2] = [0, 72];
/// No further frame is drawn plainly once this has been spent on it.
const PATIENCE: Duration = Duration::from_secs(12);
/// A frame's time is the best of so many where it is compared.
const REPEATS: usize = 5;

/// One frame by one algorithm.
#[derive(Clone, Copy, Debug)]
struct Measured {
    time: Duration,
    counters: Counters,
    seen: Seen,
}

/// A frame of the walk by both algorithms.
struct Comparison {
    number: u32,
    hierarchical: Measured,
    plain: Measured,
    same: bool,
}

/// Runs the demonstration.
pub fn run() -> Result<(), Failure> {
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).map_err(|e| {
        Failure::work(format!("{FOLDER}: cannot make this folder: {e}; go where you may write"))
    })?;
    hither_io::check_writable(&folder.join("walk-0000.png"))?;

    let scene = source::open(WORLD, &Files::default(), Verbosity::Normal)?;
    let start = Instant::now();
    let index = SceneIndex::build(scene, &IndexOptions::default());
    let mut tour = Tour::new(index)?;
    console::print(&tour.opening(start.elapsed()))?;

    let walk = tour.walk()?;
    tour.details()?;
    sheet::write(&tour.pictures, &folder.join("sheet.png"))?;
    let comparisons = tour.compare()?;
    console::print(&summary::table(tour.index.scene(), &walk, &comparisons))?;
    console::print(&summary::closing(folder))
}

struct Tour {
    index: SceneIndex,
    renderer: Renderer,
    shader: Shader,
    /// Length of the walk, seconds.
    duration: f64,
    /// What has been written, for the contact sheet.
    pictures: Vec<Image>,
}

impl Tour {
    fn new(index: SceneIndex) -> Result<Tour, Failure> {
        let scene = index.scene();
        let walk = scene.animations.first();
        let duration = walk.ok_or_else(|| Failure::work(format!("{WORLD}: nothing moves")))?.duration();
        let shader = Shader::new(scene, 0);
        Ok(Tour { index, renderer: Renderer::new(), shader, duration, pictures: Vec::new() })
    }

    fn opening(&self, index_time: Duration) -> String {
        let scene = self.index.scene();
        format!(
            "An office building of {} triangles: {} stored, shown by {} instances.\n\
             Trees over all of it in {:.0} ms; with the geometry they take {:.1} MB.\n\n",
            grouped(scene.instanced_triangle_count()),
            grouped(scene.meshes.iter().map(|m| m.triangles.len() as u64).sum()),
            grouped(scene.instance_count()),
            index_time.as_secs_f64() * 1e3,
            self.index.memory_bytes() as f64 / 1e6,
        )
    }

    /// Draws the walk; every so often a frame is shaded and written.
    fn walk(&mut self) -> Result<Vec<Measured>, Failure> {
        let bar = Verbosity::Normal.bar(u64::from(FRAMES), "walking");
        let mut walk = Vec::new();
        for number in 0..FRAMES {
            let view = self.view_of_walk(number)?;
            let (frame, measured) = self.draw(&view, Algorithm::Hzb)?;
            if number % PICTURE_EVERY == 0 {
                self.write(&frame, Shading::Smooth, &format!("walk-{number:04}.png"))?;
            }
            self.renderer.recycle(frame);
            bar.set_message(format!("{:.1} ms a frame", measured.time.as_secs_f64() * 1e3));
            bar.inc(1);
            walk.push(measured);
        }
        bar.finish_and_clear();
        Ok(walk)
    }

    /// Other ways to look at one frame, and the views from elsewhere.
    fn details(&mut self) -> Result<(), Failure> {
        let view = self.view_of_walk(0)?;
        let recorded = RenderOptions { complexity: true, ..RenderOptions::default() };
        let frame = self.renderer.render(&self.index, &view, &recorded).map_err(unusable)?;
        self.write(&frame, Shading::Ids, "ids.png")?;
        self.write(&frame, Shading::Depth, "depth.png")?;
        self.write(&frame, Shading::Normals, "normals.png")?;
        self.write(&frame, Shading::Complexity, "complexity.png")?;
        for (camera, name) in STANDPOINTS {
            let view = self.view(camera)?;
            let (frame, _) = self.draw(&view, Algorithm::Hzb)?;
            self.write(&frame, Shading::Smooth, name)?;
        }
        Ok(())
    }

    /// Draws a few frames both ways.
    fn compare(&mut self) -> Result<Vec<Comparison>, Failure> {
        let mut comparisons = Vec::new();
        let start = Instant::now();
        for number in COMPARED {
            if start.elapsed() > PATIENCE {
                break;
            }
            let view = self.view_of_walk(number)?;
            let mut best = None;
            for _ in 0..REPEATS {
                let (frame, measured) = self.draw(&view, Algorithm::Hzb)?;
                let better = best.as_ref().is_none_or(|(_, b): &(Frame, Measured)| measured.time < b.time);
                if better {
                    best = Some((frame, measured));
                }
            }
            let Some((ours, hierarchical)) = best else { continue };
            let spinner = Verbosity::Normal
                .spinner(format!("the same frame, {number}, by a plain z-buffer: some seconds"));
            let (theirs, plain) = self.draw(&view, Algorithm::ZBuffer)?;
            spinner.finish_and_clear();
            comparisons.push(Comparison { number, hierarchical, plain, same: same(&ours, &theirs) });
        }
        Ok(comparisons)
    }

    fn view_of_walk(&mut self, number: u32) -> Result<View, Failure> {
        self.index.pose(0, f64::from(number) / f64::from(FRAMES) * self.duration);
        self.view(WALK_CAMERA)
    }

    fn view(&self, camera: &str) -> Result<View, Failure> {
        let scene = self.index.scene();
        let view = scene.find_camera(camera).and_then(|index| scene.view(index, SIZE));
        view.ok_or_else(|| Failure::work(format!("{WORLD}: no camera \"{camera}\"")))
    }

    /// Draws on one thread, from scratch, and counts what is seen.
    fn draw(&mut self, view: &View, algorithm: Algorithm) -> Result<(Frame, Measured), Failure> {
        let options = RenderOptions { algorithm, ..RenderOptions::default() };
        let start = Instant::now();
        let frame = self.renderer.render(&self.index, view, &options).map_err(unusable)?;
        let time = start.elapsed();
        let measured = Measured { time, counters: frame.counters, seen: Seen::count(&frame) };
        Ok((frame, measured))
    }

    fn write(&mut self, frame: &Frame, shading: Shading, name: &str) -> Result<(), Failure> {
        let path: PathBuf = Path::new(FOLDER).join(name);
        let image = self.shader.shade(self.index.scene(), frame, shading);
        hither_io::write_png(&path, image.width, image.height, &image.pixels)?;
        self.pictures.push(image);
        Ok(())
    }
}

fn unusable(error: hither::conventions::ViewError) -> Failure {
    Failure::work(format!("{WORLD}: {error}"))
}

/// Whether two frames agree in every id and in every bit of depth.
fn same(a: &Frame, b: &Frame) -> bool {
    let mut pixels = (0..a.view.height).flat_map(|y| (0..a.view.width).map(move |x| (x, y)));
    pixels.all(|(x, y)| a.id(x, y) == b.id(x, y) && a.depth(x, y).to_bits() == b.depth(x, y).to_bits())
}
