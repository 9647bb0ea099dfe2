//! How much of a pixel a layer covers, given what is before it.
//!
//! Alpha says how much of a pixel is covered, not where. *Over* takes edges that meet in a pixel as independent
//! [Snyder & Lengyel 1997, §8, note 4]: one half covered over another lets a quarter through, though it may be a half
//! (both cover the same half, as pieces of one surface do) or nothing (each covers its own, as neighbours at a seam
//! do). So a layer's pixel is its mean *over the samples that the layers before it leave open*, each as far as they
//! do. With that for alpha *over* is exact: the share that the first lets through, times the share of this that the
//! second does, and so on, is what all of them let through. Where the layers before it leave all samples of a pixel
//! alike, open or covered, it is the plain mean, as if the layer were alone.
//!
//! In a cycle each layer is given those that occlude it there. Pixels that three layers of one cycle share remain
//! approximate, as the paper says.

use super::paint::{PaintOptions, Painted};
use super::sprite::Sprite;
use crate::conventions::View;

/// A layer that is drawn, and not settled yet.
#[derive(Clone, Debug, Default)]
pub struct Drawn {
    /// The layer as if it were alone.
    pub alone: Painted,
    /// Whether it counts as before what is behind it. Not so a layer that will be left out of the composite, or whose
    /// place another picture takes.
    pub counts: bool,
    /// Its samples, each a pixel; empty where a pixel has one.
    pub(super) samples: Sprite,
}

/// What the layers so far, front to back, leave open of each sample.
#[derive(Clone, Debug)]
pub struct Openness {
    /// Samples along a side of a pixel.
    samples: u32,
    /// Samples in a row.
    width: u32,
    /// Row by row, 1 where nothing is before the sample; empty where a pixel has one sample.
    open: Vec<f32>,
}

impl Openness {
    /// Nothing is drawn yet.
    pub fn new(view: &View, options: &PaintOptions) -> Openness {
        let fine = options.fine(view);
        let count = if options.samples > 1 { fine.width as usize * fine.height as usize } else { 0 };
        Openness { samples: options.samples.max(1), width: fine.width, open: vec![1.0; count] }
    }

    /// The pictures of the next component's layers, given what is before each. `arcs` (occluder, occluded) are the
    /// component's.
    pub fn settle(&mut self, layers: Vec<Drawn>, arcs: &[(u32, u32)]) -> Vec<Painted> {
        if self.open.is_empty() {
            return layers.into_iter().map(|layer| layer.alone).collect();
        }
        let given = |at: usize| {
            let occluders = arcs.iter().filter(|a| a.1 as usize == at).map(|a| &layers[a.0 as usize]);
            let occluders: Vec<&Sprite> = occluders.filter(|o| o.counts).map(|o| &o.samples).collect();
            self.given(&layers[at], &occluders)
        };
        let painted = (0..layers.len()).map(given).collect();
        layers.iter().filter(|layer| layer.counts).for_each(|layer| self.close(&layer.samples));
        painted
    }

    fn given(&self, layer: &Drawn, occluders: &[&Sprite]) -> Painted {
        let mut painted = layer.alone.clone();
        let Sprite { x: x0, y: y0, width, .. } = painted.sprite;
        let n = self.samples;
        let mut weights = vec![0.0; (n * n) as usize];
        for (at, pixel) in (0u32..).zip(&mut painted.sprite.pixels) {
            let (x, y) = ((x0 + at % width) * n, (y0 + at / width) * n);
            let place = |i: u32| (x + i % n, y + i / n);
            for (i, weight) in (0u32..).zip(&mut weights) {
                let (x, y) = place(i);
                *weight = f64::from(self.open[y as usize * self.width as usize + x as usize]);
                occluders.iter().for_each(|o| *weight *= 1.0 - f64::from(o.at(x, y)[3]));
            }
            if weights.iter().all(|w| *w == weights[0]) {
                continue;
            }
            let mut sum = [0.0; 4];
            for (i, &weight) in (0u32..).zip(&weights) {
                let (x, y) = place(i);
                let sample = layer.samples.at(x, y);
                sum.iter_mut().zip(sample).for_each(|(s, c)| *s += weight * f64::from(c));
            }
            let total: f64 = weights.iter().sum();
            *pixel = sum.map(|s| (s / total) as f32);
        }
        painted
    }

    /// Closes what a layer covers.
    fn close(&mut self, layer: &Sprite) {
        let width = layer.width.max(1) as usize;
        for (y, row) in (layer.y as usize..).zip(layer.pixels.chunks_exact(width)) {
            let start = y * self.width as usize + layer.x as usize;
            for (open, sample) in self.open[start..start + width].iter_mut().zip(row) {
                *open *= (1.0 - sample[3]).max(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conventions::Projection;
    use glam::DVec3;

    /// One pixel of four samples; a layer's alphas, its colour being 1.
    fn settle(layers: &[[f32; 4]], arcs: &[(u32, u32)]) -> Vec<f32> {
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        let view = View::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, projection, (1, 1));
        let options = PaintOptions { samples: 2, ..PaintOptions::default() };
        let drawn = layers.iter().map(|alphas| {
            let mean = alphas.iter().sum::<f32>() / 4.0;
            let sprite = |size, pixels| Sprite { width: size, height: size, pixels, ..Sprite::default() };
            let alone = Painted { sprite: sprite(1, vec![[mean; 4]]), distances: vec![1.0] };
            Drawn { alone, counts: true, samples: sprite(2, alphas.map(|a| [a; 4]).to_vec()) }
        });
        let mut open = Openness::new(&view, &options);
        let settled: Vec<Painted> = match arcs {
            [] => drawn.flat_map(|d| open.settle(vec![d], &[])).collect(),
            _ => open.settle(drawn.collect(), arcs),
        };
        settled.iter().map(|p| p.sprite.pixels[0][3]).collect()
    }

    #[test]
    fn alpha_is_the_share_of_what_is_open() {
        let (left, right) = ([1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]);
        assert_eq!(settle(&[left, left, [1.0; 4]], &[]), [0.5, 0.0, 1.0]);
        assert_eq!(settle(&[left, right, left], &[]), [0.5, 1.0, 0.5]);
        assert_eq!(settle(&[[0.5; 4], left], &[]), [0.5, 0.5]);
        assert_eq!(settle(&[[0.5, 1.0, 0.5, 1.0], [1.0, 0.0, 0.0, 1.0]], &[]), [0.75, 0.5]);
    }

    #[test]
    fn in_a_cycle_only_occluders_are_before() {
        let (left, right) = ([1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]);
        let ring = [(0, 1), (1, 2), (2, 0)];
        assert_eq!(settle(&[left, right, [0.0; 4]], &ring), [0.5, 1.0, 0.0]);
        assert_eq!(settle(&[left, [0.0; 4], right], &ring), [1.0, 0.0, 0.5]);
    }
}
