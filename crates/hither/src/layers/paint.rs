//! Drawing layers: some instances of a scene as if the others were not there.
//!
//! The scene is flattened once and indexed once. For each layer its instances are put in their places and the
//! last layer's are shrunk to a point behind the eye, so that nothing is built anew. Instances keep their
//! numbers, ties in depth are decided as in the whole picture, and a layer's pixels are the whole picture's to
//! the last bit wherever it is in front and opaque.

use super::coverage::Drawn;
use super::sight::Holdout;
use super::sprite::Sprite;
use crate::conventions::{Projection, View, ViewError};
use crate::geometry::Aabb;
use crate::index::{IndexOptions, SceneIndex};
use crate::render::{RenderOptions, Renderer, Shader, Shading, Window};
use crate::scene::{Content, Group, Mesh, Node, Scene, Transform};
use glam::{DAffine3, DMat3};
use std::ops::Range;

/// How layers are drawn.
#[derive(Clone, Copy, Debug)]
pub struct PaintOptions {
    /// Colours; smooth by default.
    pub shading: Shading,
    /// Samples along each side of a pixel; with more than 1 edges are antialiased by coverage.
    pub samples: u32,
    /// How visibility is found.
    pub render: RenderOptions,
}

impl Default for PaintOptions {
    fn default() -> Self {
        PaintOptions { shading: Shading::Smooth, samples: 1, render: RenderOptions::default() }
    }
}

impl PaintOptions {
    /// The view with every sample a pixel.
    pub(super) fn fine(&self, view: &View) -> View {
        let samples = self.samples.max(1);
        View { width: view.width * samples, height: view.height * samples, ..*view }
    }
}

/// A layer's picture.
#[derive(Clone, Debug, Default)]
pub struct Painted {
    /// Cut to what it covers.
    pub sprite: Sprite,
    /// For each pixel of the sprite the mean distance along the view axis of what it shows that is opaque,
    /// metres; +∞ where there is nothing.
    pub distances: Vec<f32>,
}

/// Draws some of a scene's instances at a time.
#[derive(Debug)]
pub struct LayerPainter {
    pub(super) index: SceneIndex,
    pub(super) renderer: Renderer,
    shader: Shader,
    pub(super) poses: Vec<DAffine3>,
    /// Of each instance its mesh, and of each mesh the box around it.
    meshes: Vec<u32>,
    bounds: Vec<Aabb>,
    shown: Vec<u32>,
}

impl LayerPainter {
    /// Prepares to draw instances of `scene` in its present pose. Cost: a copy and an index of it.
    pub fn new(scene: &Scene) -> LayerPainter {
        let instances = scene.instances();
        let poses: Vec<DAffine3> = instances.iter().map(|i| i.world_from_mesh).collect();
        let node = |i: &crate::scene::Instance| Node {
            local: Transform::Affine(hidden(&DAffine3::IDENTITY)),
            content: Content::Mesh(i.mesh),
            ..Node::default()
        };
        let nodes = instances.iter().map(node).collect();
        let flat = Scene {
            groups: vec![Group { name: String::new(), nodes }],
            root: 0,
            cameras: Vec::new(),
            animations: Vec::new(),
            name: scene.name.clone(),
            meshes: scene.meshes.clone(),
            materials: scene.materials.clone(),
            textures: scene.textures.clone(),
        };
        let shader = Shader::new(&flat, 0);
        let mut index = SceneIndex::build(flat, &IndexOptions::default());
        // Everything moves from the start: otherwise its tree would be made anew with each thing that joins.
        let nowhere = DAffine3 { matrix3: DMat3::ZERO, ..DAffine3::from_translation(glam::DVec3::ONE) };
        index.set_transforms((0..poses.len() as u32).map(|i| (i, Transform::Affine(nowhere))));
        let meshes = instances.iter().map(|i| i.mesh).collect();
        let bounds = scene.meshes.iter().map(Mesh::bounds).collect();
        LayerPainter { index, renderer: Renderer::new(), shader, poses, meshes, bounds, shown: Vec::new() }
    }

    /// Follows the scene to another pose; it must be the same scene otherwise.
    pub fn pose(&mut self, scene: &Scene) {
        self.poses = scene.instances().iter().map(|i| i.world_from_mesh).collect();
    }

    /// Draws `instances` alone.
    pub fn paint(
        &mut self,
        instances: &[u32],
        view: &View,
        options: &PaintOptions,
    ) -> Result<Painted, ViewError> {
        Ok(self.draw(instances, view, options, None)?.alone)
    }

    /// Draws `instances` alone, without what is held out of them, for [`Openness::settle`](super::Openness::settle).
    /// Memory while it works: some hundred bytes a sample.
    pub fn draw(
        &mut self,
        instances: &[u32],
        view: &View,
        options: &PaintOptions,
        holdout: Option<&Holdout>,
    ) -> Result<Drawn, ViewError> {
        self.show(instances, view);
        let samples = options.samples.max(1);
        let fine = options.fine(view);
        let frame = self.renderer.render(&self.index, &fine, &options.render)?;
        let window = self.window(instances, view);
        let in_samples = |range: &Range<u32>| range.start * samples..range.end * samples;
        let all = Window { columns: in_samples(&window.columns), rows: in_samples(&window.rows) };
        let image = self.shader.shade_within(self.index.scene(), &frame, options.shading, &all);
        let columns = all.columns.start as usize..all.columns.end as usize;
        let rows = image.pixels.chunks_exact(fine.width as usize);
        let mut shaded: Vec<[f32; 4]> = rows.flat_map(|row| &row[columns.clone()]).copied().collect();
        if let Some(holdout) = holdout.filter(|h| h.samples() > 0) {
            let places = all.rows.clone().flat_map(|y| all.columns.clone().map(move |x| (x, y)));
            for (pixel, (x, y)) in shaded.iter_mut().zip(places) {
                if holdout.holds(x, y) {
                    *pixel = [0.0; 4];
                }
            }
        }
        let samples_sprite = if samples > 1 { Sprite::of_window(&all, &shaded) } else { Sprite::default() };
        let pixels = if samples > 1 { reduced(&shaded, all.columns.len(), samples) } else { shaded };
        let sprite = Sprite::of_window(&window, &pixels);
        let mean = |x: u32, y: u32| {
            let all = (0..samples * samples).map(|i| (x * samples + i % samples, y * samples + i / samples));
            let (mut sum, mut count) = (0.0, 0);
            for distance in all.map(|(x, y)| frame.distance(x, y)).filter(|d| d.is_finite()) {
                (sum, count) = (sum + distance, count + 1);
            }
            if count > 0 { (sum / f64::from(count)) as f32 } else { f32::INFINITY }
        };
        let rows = sprite.y..sprite.y + sprite.height;
        let distances = rows
            .flat_map(|y| (sprite.x..sprite.x + sprite.width).map(move |x| (x, y)))
            .map(|(x, y)| mean(x, y));
        let alone = Painted { distances: distances.collect(), sprite };
        self.renderer.recycle(frame);
        Ok(Drawn { alone, counts: true, samples: samples_sprite })
    }

    /// The part of the picture outside of which instances show nothing.
    fn window(&self, instances: &[u32], view: &View) -> Window {
        // Columns and rows, in pixels from the middle.
        let mut around = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for &instance in instances {
            let (mesh, pose) = (self.meshes[instance as usize], &self.poses[instance as usize]);
            let in_view = view.view_from_world * *pose;
            let Aabb { min, max } = self.bounds[mesh as usize].transformed(&in_view);
            // More than what is lost far from the origin, where large numbers cancel.
            let lost = pose.translation.abs().max_element() + in_view.translation.abs().max_element();
            let (min, max) = (min - lost * 1e-12, max + lost * 1e-12);
            let distances = match view.projection {
                Projection::Perspective { near, .. } if -max.z > near => [-max.z, -min.z],
                // What may reach the near plane may be anywhere.
                Projection::Perspective { .. } => return Window::of(view),
                Projection::Orthographic { .. } => [1.0; 2],
            };
            let sides = [[min.x, max.x], [-max.y, -min.y]];
            for ([low, high], sides) in around.iter_mut().zip(sides) {
                for side in distances.iter().flat_map(|d| sides.map(|side| side / d)) {
                    (*low, *high) = (low.min(side), high.max(side));
                }
            }
        }
        let pixels = |[low, high]: [f64; 2], size: u32| {
            // A pixel more than corners are snapped by, and than numbers are off.
            let at = |side: f64, more: f64| side * view.pixels_per_unit() + f64::from(size) * 0.5 + more;
            let [first, end] =
                [at(low, -2.0).floor(), at(high, 2.0).ceil()].map(|v| v.clamp(0.0, f64::from(size)) as u32);
            first..end.max(first)
        };
        Window { columns: pixels(around[0], view.width), rows: pixels(around[1], view.height) }
    }

    /// Puts `instances` in their places and all others out of sight.
    pub(super) fn show(&mut self, instances: &[u32], view: &View) {
        let gone = hidden(&view.view_from_world.inverse());
        let hide = std::mem::take(&mut self.shown).into_iter().map(|i| (i, Transform::Affine(gone)));
        let show = instances.iter().map(|&i| (i, Transform::Affine(self.poses[i as usize])));
        self.index.set_transforms(hide.chain(show));
        self.shown = instances.to_vec();
    }

    /// Draws everything: what the composite is compared with.
    pub fn paint_all(&mut self, view: &View, options: &PaintOptions) -> Result<Painted, ViewError> {
        let all: Vec<u32> = (0..self.poses.len() as u32).collect();
        self.paint(&all, view, options)
    }
}

/// Everything shrunk to a point half a metre behind the eye.
fn hidden(world_from_view: &DAffine3) -> DAffine3 {
    let behind = world_from_view.transform_point3(glam::DVec3::new(0.0, 0.0, 0.5));
    DAffine3 { matrix3: DMat3::ZERO, translation: behind }
}

/// The mean of each square of `samples` × `samples` pixels of a picture so many wide.
fn reduced(pixels: &[[f32; 4]], w: usize, samples: u32) -> Vec<[f32; 4]> {
    let n = samples as usize;
    if w == 0 {
        return Vec::new();
    }
    let share = 1.0 / (n * n) as f64;
    let rows = pixels.chunks_exact(w * n);
    rows.flat_map(|rows| {
        (0..w / n).map(move |x| {
            let mut sum = [0.0f64; 4];
            for y in 0..n {
                for p in &rows[y * w + x * n..y * w + (x + 1) * n] {
                    sum.iter_mut().zip(p).for_each(|(s, c)| *s += f64::from(*c));
                }
            }
            sum.map(|s| (s * share) as f32)
        })
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::trouble;

    #[test]
    fn a_layer_is_what_the_whole_picture_of_it_shows() {
        let mut shown = 0;
        for seed in 0..150 {
            let (scene, view) = (trouble::scene(seed), trouble::view(seed));
            let mut painter = LayerPainter::new(&scene);
            for samples in [1, 2] {
                let options = PaintOptions { samples, ..PaintOptions::default() };
                for instance in 0..painter.poses.len().min(6) as u32 {
                    let painted = painter.paint(&[instance], &view, &options).unwrap().sprite;
                    let fine = options.fine(&view);
                    let frame = painter.renderer.render(&painter.index, &fine, &options.render).unwrap();
                    let image = painter.shader.shade(painter.index.scene(), &frame, options.shading);
                    let whole = reduced(&image.pixels, fine.width as usize, samples);
                    assert_eq!(painted, Sprite::cut(view.width, &whole), "seed {seed}, instance {instance}");
                    shown += usize::from(!painted.is_empty());
                }
            }
        }
        assert!(shown > 100, "{shown}");
    }
}
