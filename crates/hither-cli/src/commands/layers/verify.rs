//! How the composite differs from the picture drawn directly.

use super::{Layer, Taken};
use crate::console::Verbosity;
use crate::failure::Failure;
use crate::numbers::{grouped, short};
use crate::timeline::Timeline;
use hither::Scene;
use hither::conventions::View;
use hither::layers::{LayerPainter, PaintOptions};
use serde_json::{Value, json};

/// A scene as it was before some of it was split.
pub struct Direct(Option<(Scene, LayerPainter)>);

impl Direct {
    /// Keeps a copy of the scene, if one is needed.
    pub fn of(scene: &Scene, needed: bool) -> Direct {
        Direct(needed.then(|| (scene.clone(), LayerPainter::new(scene))))
    }

    /// What draws it as it is posed in a frame; `None` if there is no copy.
    pub fn painter(&mut self, timeline: &Timeline, frame: u32) -> Result<Option<&mut LayerPainter>, Failure> {
        let Some((scene, painter)) = &mut self.0 else { return Ok(None) };
        timeline.pose_scene(scene, frame)?;
        painter.pose(scene);
        Ok(Some(painter))
    }
}

/// Draws the picture directly, says how the composite differs, and counts pixels by what may make them differ.
pub fn verify(
    taken: &Taken,
    view: &View,
    painter: &mut LayerPainter,
    paint: &PaintOptions,
    verbosity: Verbosity,
) -> Result<Value, Failure> {
    let direct = painter.paint_all(view, paint).map_err(|e| Failure::work(e.to_string()))?.sprite;
    let direct = direct.expanded(view.width, view.height);
    let shared = shared_in_cycles(taken, view);
    let (mut differing, mut largest) = (0u64, 0.0f32);
    // More than 1/255 off, in pixels that three layers of a cycle share, and elsewhere.
    let (mut excepted, mut elsewhere) = (0u64, 0u64);
    for ((a, b), &shared) in taken.composite.pixels.iter().zip(&direct).zip(&shared) {
        let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        differing += u64::from(a != b);
        largest = largest.max(off);
        if off > 1.0 / 255.0 {
            *(if shared { &mut excepted } else { &mut elsewhere }) += 1;
        }
    }
    let shared = shared.iter().filter(|s| **s).count() as u64;
    let line = match differing {
        0 => "the composite is the direct picture, bit for bit".to_owned(),
        n => format!(
            "{} pixels differ from the direct picture, by {} at most; off by more than 1/255: {} of the {} that \
             three layers of a cycle share, {} others",
            grouped(n),
            short(f64::from(largest)),
            grouped(excepted),
            grouped(shared),
            grouped(elsewhere)
        ),
    };
    verbosity.note(&line);
    Ok(json!({
        "pixels_differing": differing,
        "largest_difference": largest,
        "three_of_a_cycle": shared,
        "beyond_one_in_255": { "three_of_a_cycle": excepted, "elsewhere": elsewhere },
    }))
}

/// For each pixel whether three layers of one cycle cover it, not all of them wholly: where compositing is approximate.
fn shared_in_cycles(taken: &Taken, view: &View) -> Vec<bool> {
    let mut shared = vec![false; view.width as usize * view.height as usize];
    let mut layers: &[Layer] = &taken.layers;
    for component in &taken.components {
        let (here, rest) = layers.split_at(component.layers.len());
        layers = rest;
        if here.len() < 3 {
            continue;
        }
        for (at, shared) in (0u32..).zip(&mut shared) {
            let alpha = |layer: &Layer| layer.painted.sprite.at(at % view.width, at / view.width)[3];
            let covering = here.iter().filter(|l| !l.out).map(alpha).filter(|&a| a > 0.0);
            let (count, partial) = covering.fold((0, false), |(n, partial), a| (n + 1, partial | (a < 1.0)));
            *shared |= count > 2 && partial;
        }
    }
    shared
}
