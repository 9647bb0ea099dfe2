//! The options that commands share, each stated once, and how their values are written.

use crate::console::Verbosity;
use crate::failure::Failure;
use clap::{Args, ValueEnum};
use glam::DVec3;
use hither::conventions::{Projection, View};
use hither::index::TreeKind;
use hither::render::{Algorithm, BoxTest, Coherence, ComplexityPanel, Shading};
use hither::{IndexOptions, RenderOptions};
use std::ops::Range;
use std::path::PathBuf;

/// What every command understands.
#[derive(Args, Debug)]
pub struct ReportOptions {
    /// Write a machine-readable report to FILE, or to standard output for `-`
    #[arg(long, value_name = "FILE|-", help_heading = "Report")]
    pub json: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Report")]
    quiet: bool,
    /// Say more
    #[arg(short, long, help_heading = "Report")]
    verbose: bool,
}

impl ReportOptions {
    /// How much to say.
    pub fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (_, true) => Verbosity::Verbose,
            _ => Verbosity::Normal,
        }
    }
}

/// From where, how large, and when.
#[derive(Args, Debug)]
pub struct ViewOptions {
    /// A camera of the scene, by name or by index from 0 [default: the first; without one, all of the scene]
    #[arg(long, value_name = "NAME|INDEX", conflicts_with = "eye", help_heading = "View")]
    pub camera: Option<String>,
    /// Where the eye is
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, help_heading = "View")]
    pub eye: Option<DVec3>,
    /// What the eye looks at [default: the middle of the scene]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, requires = "eye",
          help_heading = "View")]
    pub target: Option<DVec3>,
    /// Which way is up [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, requires = "eye",
          help_heading = "View")]
    pub up: Option<DVec3>,
    /// Vertical field of view in degrees [default: the camera's; 45 without one]
    #[arg(long, value_name = "DEGREES", value_parser = degrees, allow_hyphen_values = true,
          help_heading = "View")]
    pub fov: Option<f64>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "1280x720", help_heading = "View")]
    pub size: (u32, u32),
    /// Pose the scene at this time of its animation, in seconds [default: as the file stores it]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_hyphen_values = true,
          conflicts_with = "frames", help_heading = "Time")]
    pub time: Option<f64>,
    /// Pictures A, A+1, … up to but not including B; picture N is at N/FPS seconds
    #[arg(long, value_name = "A..B", value_parser = frames, help_heading = "Time")]
    pub frames: Option<Range<u32>>,
    /// Pictures a second
    #[arg(long, value_name = "N", value_parser = rate, default_value = "30", help_heading = "Time")]
    pub fps: f64,
    /// Which animation of the scene, by name or by index from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX", help_heading = "Time")]
    pub animation: Option<String>,
}

impl ViewOptions {
    /// Refuses a picture that is too small or too large, which no scene can change.
    pub fn check_size(&self) -> Result<(), Failure> {
        let projection = Projection::Perspective { fov_y: 1.0, near: 1.0 };
        let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, self.size);
        view.validate().map_err(|e| Failure::work(e.to_string()))
    }

    /// Refuses a picture that the operating system would not give the memory for, so far as it says so beforehand:
    /// better now than in the middle of it. `remedy` is what to choose instead.
    pub fn check_memory(&self, bytes_a_pixel: u64, remedy: &str) -> Result<(), Failure> {
        let (width, height) = self.size;
        let bytes = u64::from(width) * u64::from(height) * bytes_a_pixel;
        let mut room = Vec::<u8>::new();
        let enough = usize::try_from(bytes).is_ok_and(|bytes| room.try_reserve_exact(bytes).is_ok());
        // Room that nobody looks at need not be asked for.
        std::hint::black_box(&room);
        if enough {
            return Ok(());
        }
        let gibibytes = bytes as f64 / f64::from(1 << 30);
        Err(Failure::work(format!(
            "a picture of {width}x{height} pixels needs {gibibytes:.1} GiB of memory, more than there is; \
             choose {remedy}"
        )))
    }
}

/// How the work is done. The picture does not depend on it.
#[derive(Args, Debug)]
pub struct WorkOptions {
    /// Worker threads; 0 is one for each core
    #[arg(long, value_name = "N", default_value = "0", value_parser = clap::value_parser!(u16).range(..=1024),
          help_heading = "Work")]
    pub threads: u16,
    /// How visibility is found
    #[arg(long, value_name = "NAME", default_value = "hzb", help_heading = "Work")]
    pub algorithm: AlgorithmName,
    /// What the hierarchical z-buffer asks of boxes
    #[arg(long, value_name = "NAME", default_value = "rectangle", help_heading = "Work")]
    pub box_test: BoxTestName,
    /// Which tree the scene is sorted into
    #[arg(long, value_name = "NAME", default_value = "bvh", help_heading = "Work")]
    pub tree: TreeName,
    /// Start each picture from what was visible in the last, where that saves work
    #[arg(long, help_heading = "Work")]
    pub coherence: bool,
}

impl WorkOptions {
    /// The engine's options for drawing; `complexity` is asked for by a shading.
    pub fn render(&self, complexity: bool) -> RenderOptions {
        let algorithm = match self.algorithm {
            AlgorithmName::Hzb => Algorithm::Hzb,
            AlgorithmName::Zbuffer => Algorithm::ZBuffer,
            // Each layer is drawn by it.
            AlgorithmName::Layers => Algorithm::Hzb,
        };
        RenderOptions {
            algorithm,
            box_test: match self.box_test {
                BoxTestName::Rectangle => BoxTest::Rectangle,
                BoxTestName::Definitive => BoxTest::Definitive,
            },
            threads: usize::from(self.threads),
            coherence: if self.coherence { Coherence::WherePays } else { Coherence::Never },
            complexity,
            ..RenderOptions::default()
        }
    }

    /// The engine's options for indexing.
    pub fn index(&self) -> IndexOptions {
        let tree = match self.tree {
            TreeName::Bvh => TreeKind::Bvh,
            TreeName::Octree => TreeKind::OctreeSmallest,
            TreeName::OctreePushed => TreeKind::OctreePushed,
        };
        IndexOptions { tree }
    }
}

/// `--algorithm`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AlgorithmName {
    /// Hierarchical z-buffer
    Hzb,
    /// Plain z-buffer: every triangle in the view
    Zbuffer,
    /// Whole parts in order, each drawn alone and composited
    Layers,
}

/// `--box-test`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BoxTestName {
    /// Whether the rectangle around them is hidden
    Rectangle,
    /// And whether their outline is
    Definitive,
}

/// `--tree`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum TreeName {
    /// Wide bounding volume hierarchy
    Bvh,
    /// Octree, everything in the smallest cube around it
    Octree,
    /// Octree, small things pushed down to all cubes they touch
    OctreePushed,
}

/// `--shade`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ShadeName {
    /// Colour and a headlight on faces
    Flat,
    /// Colour and a headlight on interpolated normals
    Smooth,
    /// A colour for each instance, a little lighter or darker from triangle to triangle
    Ids,
    /// Distance as grey
    Depth,
    /// Normals as colours
    Normals,
    /// How often each pixel was visited, on a log scale
    Complexity,
    /// Of these, by tests of boxes against the z-pyramid
    ComplexityCubes,
    /// Of these, by tests and drawing of triangles
    ComplexityPolygons,
}

impl ShadeName {
    /// The engine's name for it.
    pub fn shading(self) -> Shading {
        match self {
            ShadeName::Flat => Shading::Flat,
            ShadeName::Smooth => Shading::Smooth,
            ShadeName::Ids => Shading::Ids,
            ShadeName::Depth => Shading::Depth,
            ShadeName::Normals => Shading::Normals,
            ShadeName::Complexity | ShadeName::ComplexityCubes | ShadeName::ComplexityPolygons => {
                Shading::Complexity
            }
        }
    }

    /// The part of the complexity that is shown alone.
    pub fn panel(self) -> Option<ComplexityPanel> {
        match self {
            ShadeName::ComplexityCubes => Some(ComplexityPanel::Cubes),
            ShadeName::ComplexityPolygons => Some(ComplexityPanel::Polygons),
            _ => None,
        }
    }
}

/// How many threads `--threads` asks for.
pub fn threads(number: u16) -> usize {
    match number {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n.into(),
    }
}

/// The word with which an option names `value`.
pub fn word(value: impl ValueEnum) -> String {
    value.to_possible_value().map(|v| v.get_name().to_string()).unwrap_or_default()
}

/// `R,G,B` or `R,G,B,A`: sRGB codes from 0 to 255, alpha straight.
pub fn color(text: &str) -> Result<[u8; 4], String> {
    let parts: Result<Vec<u8>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match parts.as_deref() {
        Ok(&[r, g, b]) => Ok([r, g, b, 255]),
        Ok(&[r, g, b, a]) => Ok([r, g, b, a]),
        _ => Err("write three or four whole numbers from 0 to 255, as in 255,255,255".into()),
    }
}

/// A finite number.
pub fn number(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|x| x.is_finite())
}

fn vector(text: &str) -> Result<DVec3, String> {
    let parts: Option<Vec<f64>> = text.split(',').map(number).collect();
    match parts.as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err("write three numbers, as in 1,2.5,-3".into()),
    }
}

fn degrees(text: &str) -> Result<f64, String> {
    let wrong = "write degrees above 0 and below 180";
    number(text).filter(|&d| d > 0.0 && d < 180.0).ok_or_else(|| wrong.into())
}

fn seconds(text: &str) -> Result<f64, String> {
    number(text).ok_or_else(|| "write a number of seconds".into())
}

fn rate(text: &str) -> Result<f64, String> {
    number(text).filter(|&r| r > 0.0).ok_or_else(|| "write a number above 0".into())
}

/// Zero passes here: a picture without pixels is well written, and refused as work.
fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X']);
    let sides = sides.and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    sides.ok_or_else(|| "write width x height in pixels, as in 1280x720".into())
}

fn frames(text: &str) -> Result<Range<u32>, String> {
    let ends = text.split_once("..");
    let ends = ends.and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    ends.filter(|range: &Range<u32>| !range.is_empty())
        .ok_or_else(|| "write first..end with end above first, as in 0..250".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_or_refused() {
        assert_eq!(vector("1,-2.5,3e2"), Ok(DVec3::new(1.0, -2.5, 300.0)));
        assert!(["1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1,2,inf", ""].iter().all(|t| vector(t).is_err()));
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(size("0x0"), Ok((0, 0)));
        assert!(["640", "x", "-1x5", "1x99999999999", "1x2x3"].iter().all(|t| size(t).is_err()));
        assert_eq!(frames("0..250"), Ok(0..250));
        assert!(["5..5", "6..5", "1", "..", "a..b", "0..=3"].iter().all(|t| frames(t).is_err()));
        assert_eq!(color("1,2,3"), Ok([1, 2, 3, 255]));
        assert!(["256,0,0", "1,2", "1,2,3,4,5", "a,b,c"].iter().all(|t| color(t).is_err()));
        assert!(["0", "180", "-1", "nan"].iter().all(|t| degrees(t).is_err()));
    }
}
