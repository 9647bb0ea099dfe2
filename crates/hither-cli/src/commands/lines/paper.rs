//! What is drawn on the sheet and where: one view as a camera gives it, or parallel views side by side.

use super::arguments::{Arguments, Views};
use crate::console::Verbosity;
use crate::eye::{Eye, THREE_QUARTERS};
use crate::failure::Failure;
use glam::{DVec2, DVec3};
use hither::Scene;
use hither::conventions::View;
use hither::geometry::Aabb;
use hither::hidden_line::views::{Direction, place_on_sheet, standard_view};
use hither_io::Unit;

/// Empty paper around the views and between them, pixels or millimetres.
const GAP_PX: f64 = 24.0;
const GAP_MM: f64 = 10.0;
/// Room in a view's own picture around what it shows, pixels.
const MARGIN_PX: u32 = 2;
/// The longest side of a view's own picture, pixels. Coordinates are not rounded to pixels; more would only
/// give the grid finer cells.
const LARGEST_PX: f64 = 8192.0;

/// A view and its place.
pub struct Placed {
    /// Its name, possibly empty.
    pub name: String,
    /// What it looks at.
    pub view: View,
    /// Its upper left corner on the sheet.
    pub origin: DVec2,
    /// Units of the sheet to a pixel of the view.
    pub scale: f64,
}

/// The sheet.
pub struct Paper {
    eye: Option<(Eye, (u32, u32))>,
    views: Vec<Placed>,
    size: DVec2,
    unit: Unit,
}

impl Paper {
    /// Settles what is drawn.
    pub fn choose(scene: &Scene, arguments: &Arguments, verbosity: Verbosity) -> Result<Paper, Failure> {
        let parallel = match (&arguments.views, arguments.parallel) {
            (Some(Views(names)), _) => {
                let standard = |name: &String| standard_view(name).map(|d| (name.clone(), d));
                names.iter().filter_map(standard).collect()
            }
            (None, true) => vec![(String::new(), direction(scene, arguments)?)],
            (None, false) => Vec::new(),
        };
        if parallel.is_empty() {
            if arguments.scale.is_some() {
                return Err(Failure::usage(
                    "--scale: only a parallel view has a scale; add --views or --parallel",
                ));
            }
            let size = arguments.view.size;
            let eye = Eye::choose(scene, &arguments.scene, &arguments.view, verbosity)?;
            let mut paper = Paper {
                eye: Some((eye, size)),
                views: Vec::new(),
                size: DVec2::new(f64::from(size.0), f64::from(size.1)),
                unit: Unit::Pixel,
            };
            paper.follow(scene, &arguments.scene)?;
            return Ok(paper);
        }
        sheet(scene, arguments, &parallel)
    }

    /// Takes the view of a camera that moved in the scene called `source`.
    pub fn follow(&mut self, scene: &Scene, source: &str) -> Result<(), Failure> {
        if let Some((eye, size)) = &self.eye {
            let view = eye.view(scene, source, *size)?;
            self.views = vec![Placed { name: String::new(), view, origin: DVec2::ZERO, scale: 1.0 }];
        }
        Ok(())
    }

    /// The views, in the order in which they are drawn.
    pub fn views(&self) -> &[Placed] {
        &self.views
    }

    /// Width and height.
    pub fn size(&self) -> DVec2 {
        self.size
    }

    /// What the paper is measured in.
    pub fn unit(&self) -> Unit {
        self.unit
    }
}

/// The direction that `--parallel` asks for.
fn direction(scene: &Scene, arguments: &Arguments) -> Result<Direction, Failure> {
    let up = arguments.view.up.unwrap_or(DVec3::Y);
    let Some(eye) = arguments.view.eye else { return Ok(Direction { backward: THREE_QUARTERS, up }) };
    let target = arguments.view.target.unwrap_or_else(|| bounds(scene).center());
    if eye == target {
        return Err(Failure::usage("--eye: the eye and the target are the same point; move one of them"));
    }
    Ok(Direction { backward: eye - target, up })
}

fn bounds(scene: &Scene) -> Aabb {
    scene.bounds().unwrap_or(Aabb { min: DVec3::ZERO, max: DVec3::ZERO })
}

/// Parallel views in columns and rows.
fn sheet(scene: &Scene, arguments: &Arguments, wanted: &[(String, Direction)]) -> Result<Paper, Failure> {
    let bounds = bounds(scene);
    let (unit, gap) = match arguments.scale {
        Some(_) => (Unit::Millimetre, GAP_MM),
        None => (Unit::Pixel, GAP_PX),
    };
    let angle = arguments.angle.angle();
    let (mut columns, mut rows) = ([0.0f64; 4], [0.0f64; 3]);
    for (name, direction) in wanted {
        let (column, row) = place_on_sheet(name, angle);
        let extent = direction.extent(&bounds);
        columns[column] = columns[column].max(extent.x);
        rows[row] = rows[row].max(extent.y);
    }
    let total = DVec2::new(columns.iter().sum(), rows.iter().sum());
    let used = |name_of: fn((usize, usize)) -> usize| {
        let mut at: Vec<usize> = wanted.iter().map(|(n, _)| name_of(place_on_sheet(n, angle))).collect();
        at.sort_unstable();
        at.dedup();
        at
    };
    let (used_columns, used_rows) = (used(|p| p.0), used(|p| p.1));
    let gaps = DVec2::new(used_columns.len() as f64 + 1.0, used_rows.len() as f64 + 1.0) * gap;
    // Units of the sheet to a metre of the scene.
    let per_metre = match arguments.scale {
        Some(scale) => 1000.0 / scale,
        None => {
            let (w, h) = arguments.view.size;
            let room = (DVec2::new(f64::from(w), f64::from(h)) - gaps).max(DVec2::ONE);
            let fit = room / total.max(DVec2::splat(f64::MIN_POSITIVE));
            let fit = fit.min_element();
            if fit.is_finite() && fit < 1e300 { fit } else { 1.0 }
        }
    };
    let largest = columns.iter().chain(&rows).fold(0.0f64, |m, &x| m.max(x)) * per_metre;
    let pixels_per_unit = match unit {
        Unit::Pixel => 1.0,
        Unit::Millimetre => (LARGEST_PX / largest.max(1e-9)).clamp(1e-6, 10.0),
    };
    let size = match arguments.scale {
        Some(_) => total * per_metre + gaps,
        None => DVec2::new(f64::from(arguments.view.size.0), f64::from(arguments.view.size.1)),
    };
    // Without a scale the views are in the middle of the paper.
    let spare = (size - (total * per_metre + gaps)) * 0.5;
    let middle = |lengths: &[f64], used: &[usize], at: usize, spare: f64| {
        let before: f64 = used.iter().filter(|&&i| i < at).map(|&i| lengths[i] * per_metre + gap).sum();
        spare + gap + before + lengths[at] * per_metre * 0.5
    };
    let mut views = Vec::new();
    for (name, direction) in wanted {
        let (column, row) = place_on_sheet(name, angle);
        let view = direction.view(&bounds, per_metre * pixels_per_unit, MARGIN_PX);
        view.validate().map_err(|e| Failure::work(e.to_string()))?;
        let center = DVec2::new(
            middle(&columns, &used_columns, column, spare.x),
            middle(&rows, &used_rows, row, spare.y),
        );
        let half = DVec2::new(f64::from(view.width), f64::from(view.height)) * 0.5 / pixels_per_unit;
        let (origin, scale) = (center - half, 1.0 / pixels_per_unit);
        views.push(Placed { name: name.clone(), view, origin, scale });
    }
    Ok(Paper { eye: None, views, size, unit })
}
