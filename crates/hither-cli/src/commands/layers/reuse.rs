//! How often layers must be drawn if they may be warped, and what that does to the pictures.

use super::Taken;
use crate::commands::sorting::Sorting;
use crate::failure::Failure;
use crate::numbers::short;
use glam::DVec2;
use hither::Scene;
use hither::conventions::View;
use hither::layers::Sprite;
use hither::layers::depth_of_field::rms_difference;
use hither::layers::reuse::{Memory, on_screen, warp};
use serde_json::{Value, json};

/// Pictures kept, and what was counted.
pub struct Reuse {
    budget_px: f64,
    layers: Memory,
    /// Each part as if it were a layer of its own.
    parts: Memory,
    frames: u32,
    /// Drawn and all, in units and in polygons: layers of one part warped, of several always drawn.
    merged: [f64; 4],
    /// The same without that penalty.
    alone: [f64; 4],
    error: f64,
}

impl Reuse {
    /// Up to so many pixels off.
    pub fn new(budget_px: f64) -> Result<Reuse, Failure> {
        if !(budget_px.is_finite() && budget_px >= 0.0) {
            return Err(Failure::usage(format!("--reuse {budget_px}: write a number of pixels from 0")));
        }
        let (layers, parts) = (Memory::default(), Memory::default());
        Ok(Reuse { budget_px, layers, parts, frames: 0, merged: [0.0; 4], alone: [0.0; 4], error: 0.0 })
    }

    /// Decides for each layer, and composites what is drawn with what is warped.
    pub fn frame(&mut self, scene: &Scene, sorting: &Sorting, view: &View, taken: &Taken) {
        let instances = scene.instances();
        let size = (view.width, view.height);
        let mut used: Vec<Sprite> = Vec::new();
        for layer in &taken.layers {
            let points = |part: u32| on_screen(view, sorting.parts.hull_points(part as usize, &instances));
            let mut anew = 0.0;
            let mut all: Option<Vec<DVec2>> = Some(Vec::new());
            for &part in &layer.parts {
                let now = points(part);
                let weight = sorting.parts.parts[part as usize].triangles as f64;
                let draw = self.parts.recall(&[part], now.as_deref(), self.budget_px).is_none();
                self.count(true, draw, weight);
                anew += weight;
                if draw {
                    self.parts.keep(&[part], now.clone(), Sprite::default());
                }
                all = all.zip(now).map(|(a, b)| [a, b].concat());
            }
            // What is cut from a layer changes from frame to frame.
            let several = layer.parts.len() > 1 || layer.held_out > 0;
            let fit = self.layers.recall(&layer.parts, all.as_deref(), self.budget_px).filter(|_| !several);
            let share = anew / layer.parts.len() as f64;
            layer.parts.iter().for_each(|_| self.count(false, fit.is_none(), share));
            if fit.is_none() {
                // Nor is what is cut a picture of the whole layer, for when nothing is cut from it.
                self.layers.keep(&layer.parts, all.filter(|_| !several), layer.painted.sprite.clone());
            }
            used.push(match fit.zip(self.layers.picture(&layer.parts)) {
                // Another picture in the layer's place does not move with it.
                Some((fit, earlier)) if !layer.replaced => warp(earlier, &fit.now_from_then, size),
                _ => layer.painted.sprite.clone(),
            });
        }
        let warped = taken.program.run(size, |l| (!taken.layers[l as usize].out).then(|| &used[l as usize]));
        self.error += rms_difference(&warped, &taken.composite);
        self.frames += 1;
    }

    fn count(&mut self, alone: bool, draw: bool, polygons: f64) {
        // The first frame is drawn whatever happens.
        if self.frames == 0 {
            return;
        }
        let tally = if alone { &mut self.alone } else { &mut self.merged };
        tally[1] += 1.0;
        tally[3] += polygons;
        if draw {
            tally[0] += 1.0;
            tally[2] += polygons;
        }
    }

    fn rates(&self) -> [f64; 5] {
        let share =
            |tally: &[f64; 4], at: usize| if tally[at + 1] > 0.0 { tally[at] / tally[at + 1] } else { 1.0 };
        [
            share(&self.merged, 0),
            share(&self.alone, 0),
            share(&self.merged, 2),
            share(&self.alone, 2),
            self.error / f64::from(self.frames.max(1)),
        ]
    }

    /// In words.
    pub fn line(&self) -> String {
        let [merged, alone, merged_polygons, alone_polygons, error] = self.rates();
        let percent = |share: f64| format!("{} %", short(share * 100.0));
        format!(
            "drawn anew with up to {} px of error: {} of the parts ({} without the penalty for merged ones), {} of the \
             polygons ({}); root mean square error {}",
            short(self.budget_px),
            percent(merged),
            percent(alone),
            percent(merged_polygons),
            percent(alone_polygons),
            short(error)
        )
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let [merged, alone, merged_polygons, alone_polygons, error] = self.rates();
        json!({
            "budget_px": self.budget_px,
            "update_rate_unit": merged,
            "update_rate_unit_without_penalty": alone,
            "update_rate_polygons": merged_polygons,
            "update_rate_polygons_without_penalty": alone_polygons,
            "rms_error": error,
        })
    }
}
