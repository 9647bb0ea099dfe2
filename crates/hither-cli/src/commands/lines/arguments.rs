//! The options of `hither lines`.

use crate::options::{self, ReportOptions, ViewOptions};
use clap::ValueEnum;
use glam::DVec3;
use hither::hidden_line::views::{Angle, STANDARD_VIEWS};
use hither::hidden_line::{FaceColor, Kinds, LineOptions, SectionPlane};
use std::path::PathBuf;

/// A scene as a line drawing
#[derive(clap::Args)]
pub struct Arguments {
    /// A .glb, .gltf, .obj, .stl or .ply file, or a generated world, as in `world:office?n=3`
    pub scene: String,
    /// The drawing: .svg, .dxf or .json. With --frames each `#` of a run in the name stands for a digit of
    /// the drawing's number; without one, out.svg becomes out.0001.svg
    #[arg(short, value_name = "FILE", required_unless_present = "json")]
    pub output: Option<PathBuf>,
    /// Which lines: silhouette, crease, boundary, border, intersection, contact, marked (the model's own lines);
    /// or all, or none
    #[arg(long, value_name = "LIST", value_parser = kinds, default_value = "all", help_heading = "Lines")]
    pub edges: Kinds,
    /// From which angle between neighbouring faces on their edge is a crease, in degrees; at 0 every edge is
    /// one but those within a plane
    #[arg(long, value_name = "DEGREES", value_parser = crease, default_value = "30", help_heading = "Lines")]
    pub crease: f64,
    /// Draw hidden lines, too, as a class of their own
    #[arg(long, help_heading = "Lines")]
    pub hidden: bool,
    /// Let transparent materials hide nothing
    #[arg(long, help_heading = "Lines")]
    pub see_through: bool,
    /// Cut away where NX·x + NY·y + NZ·z > D; or x=D, y=D, z=D, -x=D, … for short. May be given several times
    #[arg(long, value_name = "NX,NY,NZ,D", value_parser = section, allow_hyphen_values = true,
          help_heading = "Lines")]
    pub cut: Vec<SectionPlane>,
    /// Fill visible faces
    #[arg(long, value_name = "COLOR", help_heading = "Faces")]
    pub faces: Option<Faces>,
    /// Hatch visible faces with lines this far apart, in pixels or millimetres of the paper
    #[arg(long, value_name = "SPACING", value_parser = spacing, help_heading = "Faces")]
    pub hatch: Option<f64>,
    /// Several parallel views on one sheet: front, back, left, right, top, bottom, iso
    #[arg(long, value_name = "LIST", value_parser = views, conflicts_with_all = ["camera", "eye", "fov"],
          help_heading = "Sheet")]
    pub views: Option<Views>,
    /// How views are arranged: third angle (top above front) or first angle (top below front)
    #[arg(long, value_name = "NAME", default_value = "third", help_heading = "Sheet")]
    pub angle: AngleName,
    /// Draw in parallel projection, all of the scene, along the line from --eye to --target
    #[arg(long, conflicts_with_all = ["camera", "fov", "views"], help_heading = "Sheet")]
    pub parallel: bool,
    /// Draw to scale, in millimetres, as in 1:50; needs --views or --parallel
    #[arg(long, value_name = "1:N", value_parser = scale, help_heading = "Sheet")]
    pub scale: Option<f64>,
    /// Lines to add to the SVG's stylesheet
    #[arg(long, value_name = "CSS", help_heading = "Sheet")]
    pub style: Option<String>,
    /// Worker threads; 0 is one for each core
    #[arg(long, value_name = "N", default_value = "0", value_parser = clap::value_parser!(u16).range(..=1024),
          help_heading = "Work")]
    pub threads: u16,
    #[command(flatten)]
    pub view: ViewOptions,
    #[command(flatten)]
    pub report: ReportOptions,
}

impl Arguments {
    /// The engine's options.
    pub fn line_options(&self) -> LineOptions {
        LineOptions {
            kinds: self.edges,
            crease_angle: self.crease.to_radians(),
            hidden: self.hidden,
            transparent_hides: !self.see_through,
            sections: self.cut.clone(),
            faces: self.faces.map(Faces::color),
            hatch: self.hatch,
        }
    }
}

/// `--faces`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Faces {
    /// White
    White,
    /// The material's colour
    Material,
    /// The material's colour, darker where a face turns away
    Flat,
}

impl Faces {
    /// The engine's name for it.
    fn color(self) -> FaceColor {
        match self {
            Faces::White => FaceColor::White,
            Faces::Material => FaceColor::Material,
            Faces::Flat => FaceColor::Flat,
        }
    }
}

/// `--angle`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum AngleName {
    /// Third angle
    Third,
    /// First angle
    First,
}

impl AngleName {
    /// The engine's name for it.
    pub fn angle(self) -> Angle {
        match self {
            AngleName::Third => Angle::Third,
            AngleName::First => Angle::First,
        }
    }
}

/// `--views`: standard views, each once.
#[derive(Clone, Debug)]
pub struct Views(pub Vec<String>);

fn views(text: &str) -> Result<Views, String> {
    let mut names: Vec<String> = Vec::new();
    for name in text.split(',').map(str::trim) {
        if !STANDARD_VIEWS.contains(&name) {
            return Err(format!("there is no view \"{name}\"; there are {}", STANDARD_VIEWS.join(", ")));
        }
        if names.iter().all(|known| known != name) {
            names.push(name.to_owned());
        }
    }
    Ok(Views(names))
}

fn kinds(text: &str) -> Result<Kinds, String> {
    let mut kinds = Kinds::NONE;
    for name in text.split(',').map(str::trim) {
        match name {
            "all" => kinds = Kinds::ALL,
            "none" => {}
            "silhouette" => kinds.silhouette = true,
            "crease" => kinds.crease = true,
            "boundary" => kinds.boundary = true,
            "border" => kinds.border = true,
            "intersection" => kinds.intersection = true,
            "contact" => kinds.contact = true,
            "marked" => kinds.marked = true,
            _ => {
                let known = "silhouette, crease, boundary, border, intersection, contact, marked, all, none";
                return Err(format!("there are no lines \"{name}\"; there are {known}"));
            }
        }
    }
    Ok(kinds)
}

fn crease(text: &str) -> Result<f64, String> {
    let angle = options::number(text).filter(|a| (0.0..=180.0).contains(a));
    angle.ok_or_else(|| "write degrees from 0 to 180".into())
}

fn spacing(text: &str) -> Result<f64, String> {
    // Closer lines than this would fill the paper, and the memory.
    options::number(text).filter(|&s| s >= 0.05).ok_or_else(|| "write a distance of 0.05 or more".into())
}

/// How many metres of the scene a metre of paper shows.
fn scale(text: &str) -> Result<f64, String> {
    let (paper, scene) = text.split_once(':').ok_or("write a scale, as in 1:50")?;
    match (options::number(paper), options::number(scene)) {
        (Some(p), Some(s)) if p > 0.0 && s > 0.0 && (s / p).is_normal() => Ok(s / p),
        _ => Err("write a scale of two numbers above 0, as in 1:50".into()),
    }
}

fn section(text: &str) -> Result<SectionPlane, String> {
    let wrong = || "write NX,NY,NZ,D, or x=D, y=D, z=D, -x=D, -y=D or -z=D".to_owned();
    if let Some((axis, at)) = text.split_once('=') {
        let at = options::number(at).ok_or_else(wrong)?;
        let (sign, axis) = match axis.trim().strip_prefix('-') {
            Some(axis) => (-1.0, axis),
            None => (1.0, axis.trim()),
        };
        let axis = match axis {
            "x" => DVec3::X,
            "y" => DVec3::Y,
            "z" => DVec3::Z,
            _ => return Err(wrong()),
        };
        return Ok(SectionPlane { point: axis * at, normal: axis * sign });
    }
    let numbers: Option<Vec<f64>> = text.split(',').map(options::number).collect();
    match numbers.as_deref() {
        Some(&[x, y, z, d]) => {
            let normal = DVec3::new(x, y, z);
            let length = normal.length_squared();
            if !length.is_normal() {
                return Err("the plane has no normal; one of the first three numbers must not be 0".into());
            }
            let point = normal * (d / length);
            if !point.is_finite() {
                return Err("the plane is farther away than numbers go; D is too large for its normal".into());
            }
            Ok(SectionPlane { point, normal })
        }
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_or_refused() {
        assert_eq!(scale("1:50"), Ok(50.0));
        assert_eq!(scale("2:1"), Ok(0.5));
        assert!(["50", "1:0", "1:x", "-1:2", ":"].iter().all(|t| scale(t).is_err()));
        assert_eq!(section("y=1.5"), Ok(SectionPlane { point: DVec3::Y * 1.5, normal: DVec3::Y }));
        assert_eq!(section("-z=2"), Ok(SectionPlane { point: DVec3::Z * 2.0, normal: DVec3::NEG_Z }));
        assert_eq!(section("0,2,0,4").unwrap().point, DVec3::Y * 2.0);
        assert!(section("1e-150,0,0,1e-150").is_ok() && section("1e-150,0,0,-1e308").is_err());
        assert!(["w=1", "y=", "1,2,3", "0,0,0,1", ""].iter().all(|t| section(t).is_err()));
        assert!(views("front, top").is_ok() && views("front,side").is_err());
        assert!(kinds("crease,silhouette").unwrap().crease && kinds("edges").is_err());
        assert_eq!(kinds("marked"), Ok(Kinds { marked: true, ..Kinds::NONE }));
    }
}
