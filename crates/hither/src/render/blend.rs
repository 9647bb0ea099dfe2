//! Blended surfaces over a shaded picture: every one in front of what is opaque, in exact depth order at each
//! pixel centre, however surfaces cross and nest.
//!
//! Fragments are kept as one list a band of rows, sorted by pixel, depth and id; memory is bounded by the
//! band, not by the picture. A tie in depth goes to the smaller id, between blended and opaque surfaces too.

use super::Frame;
use super::shade::{
    Image, Placed, PlacedInstances, Rays, SeenTriangle, Setting, TriangleInView, depth_at, instances_among,
    pixel_centre,
};
use crate::conventions::{Projection, SurfaceId, View};
use crate::geometry::Aabb;
use crate::raster::{Footprint, ScreenFromObject};
use crate::scene::{Content, Group, InstanceLocator, Mesh, Scene};
use glam::{DAffine3, DVec2, Vec4};
use rayon::prelude::*;
use std::ops::Range;

/// Pixels of a band; at twenty layers everywhere a band's fragments take about 30 MB.
const BAND_PIXELS: usize = 32_768;

/// A blended surface at a pixel centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Row × image width + column.
    pub pixel: u32,
    /// As `conventions` defines it, in (0, 1].
    pub depth: f32,
    /// Which surface.
    pub id: SurfaceId,
}

impl Fragment {
    fn place(&self, view: &View) -> (u32, u32) {
        (self.pixel % view.width, self.pixel / view.width)
    }

    /// Whether it may be before what is opaque, as far as the frame's depth can tell.
    fn may_be_before(&self, frame: &Frame) -> bool {
        let (x, y) = self.place(&frame.view);
        self.depth > frame.depth(x, y) * (1.0 - ABOUT)
    }

    /// The opaque surface, where that is about as near.
    fn beside(&self, frame: &Frame) -> Option<SurfaceId> {
        let (x, y) = self.place(&frame.view);
        frame.id(x, y).filter(|_| self.depth < frame.depth(x, y) * (1.0 + ABOUT))
    }
}

/// Depths that differ by a larger share are not those of one place. The frame's are found by other operations than
/// fragments', in f32: where they are closer, the opaque surface's is found anew, as fragments' are, so that a tie is one.
const ABOUT: f32 = 1e-3;

/// Leaves those that are before what is opaque: nearer, or as near and with a smaller id.
fn retain_what_is_before(
    found: &mut Vec<Fragment>,
    setting: &Setting,
    frame: &Frame,
    instances: &PlacedInstances,
) {
    let mut last: Option<(SurfaceId, TriangleInView)> = None;
    found.retain(|f| {
        let Some(id) = f.beside(frame) else { return true };
        let (x, y) = f.place(&frame.view);
        let in_view = match &last {
            Some((of, in_view)) if *of == id => in_view,
            _ => {
                let corners = instances.get(id.instance).corners(setting.scene, id.triangle);
                &last.insert((id, TriangleInView::new(&setting.rays, corners))).1
            }
        };
        let distance = in_view.distance(in_view.weights(pixel_centre(x, y)));
        let opaque = depth_at(&frame.view.projection, distance).unwrap_or_else(|| frame.depth(x, y));
        f.depth > opaque || f.depth == opaque && f.id < id
    });
}

/// A fragment with its colour: linear RGBA, straight alpha.
struct Shaded {
    fragment: Fragment,
    color: Vec4,
}

/// Composites the blended surfaces of a scene over `image`, the shaded picture of `frame`'s rows from `top` on.
///
/// `fragments(rows)` is as [`Shader::shade_with`](super::Shader::shade_with) demands.
pub(super) fn composite(
    image: &mut Image,
    top: u32,
    setting: &Setting,
    frame: &Frame,
    locator: &InstanceLocator,
    fragments: &(impl Fn(Range<u32>) -> Vec<Fragment> + Sync),
) {
    let width = frame.view.width as usize;
    let rows = rows_of_a_band(&frame.view) as usize;
    image.pixels.par_chunks_mut(rows * width).enumerate().for_each(|(band, pixels)| {
        let first = top as usize + band * rows;
        let found = fragments(first as u32..(first + pixels.len() / width) as u32);
        let mut shaded = shade_what_shows(found, setting, frame, locator);
        shaded.sort_unstable_by(|a, b| {
            let (a, b) = (&a.fragment, &b.fragment);
            a.pixel.cmp(&b.pixel).then(b.depth.total_cmp(&a.depth)).then(a.id.cmp(&b.id))
        });
        shaded.dedup_by_key(|s| (s.fragment.pixel, s.fragment.id));
        for layers in shaded.chunk_by(|a, b| a.fragment.pixel == b.fragment.pixel) {
            let pixel = &mut pixels[layers[0].fragment.pixel as usize - first * width];
            *pixel = over(layers.iter().map(|s| s.color), Vec4::from_array(*pixel)).to_array();
        }
    });
}

/// The instances with a fragment that shows, ascending, each with the depth of its nearest such fragment.
///
/// As in [`composite`], a fragment shows where it is before what is opaque and its alpha is above 0.
pub(super) fn instances_that_show(
    setting: &Setting,
    frame: &Frame,
    locator: &InstanceLocator,
    fragments: &(impl Fn(Range<u32>) -> Vec<Fragment> + Sync),
) -> Vec<(u32, f32)> {
    let (rows, height) = (rows_of_a_band(&frame.view), frame.view.height);
    let bands = (0..height.div_ceil(rows)).into_par_iter().flat_map_iter(|band| {
        let found = fragments(band * rows..((band + 1) * rows).min(height));
        let shaded = shade_what_shows(found, setting, frame, locator);
        nearest_of_each(shaded.iter().map(|s| (s.fragment.id.instance, s.fragment.depth)).collect())
    });
    nearest_of_each(bands.collect())
}

/// One depth of each instance, the nearest; ascending by instance.
fn nearest_of_each(mut depths: Vec<(u32, f32)>) -> Vec<(u32, f32)> {
    depths.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    depths.dedup_by_key(|d| d.0);
    depths
}

fn rows_of_a_band(view: &View) -> u32 {
    (BAND_PIXELS as u32 / view.width).max(1)
}

/// Of the fragments of a band those that show, in any order, with their colours.
fn shade_what_shows(
    mut found: Vec<Fragment>,
    setting: &Setting,
    frame: &Frame,
    locator: &InstanceLocator,
) -> Vec<Shaded> {
    let view = &frame.view;
    found.retain(|f| f.may_be_before(frame));
    let ids = found.iter().flat_map(|f| [Some(f.id), f.beside(frame)]).flatten();
    let instances = PlacedInstances::look_up(instances_among(ids), setting.scene, locator, view);
    retain_what_is_before(&mut found, setting, frame, &instances);
    shade_fragments(found, setting, &instances, |f| pixel_centre(f.pixel % view.width, f.pixel / view.width))
}

/// Fragments of one triangle usually come together, so that it is set up once.
fn shade_fragments(
    fragments: Vec<Fragment>,
    setting: &Setting,
    instances: &PlacedInstances,
    centre: impl Fn(&Fragment) -> DVec2,
) -> Vec<Shaded> {
    let mut shaded = Vec::with_capacity(fragments.len());
    for same in fragments.chunk_by(|a, b| a.id == b.id) {
        let id = same[0].id;
        let seen = SeenTriangle::new(setting, instances.get(id.instance), id.triangle);
        let colored = same.iter().map(|f| Shaded { fragment: *f, color: seen.color(setting, centre(f)) });
        shaded.extend(colored.filter(|s| s.color.w > 0.0));
    }
    shaded
}

/// `layers` (straight alpha, front to back) over `ground` (premultiplied).
fn over(layers: impl Iterator<Item = Vec4>, ground: Vec4) -> Vec4 {
    let mut sum = Vec4::ZERO;
    for layer in layers {
        let premultiplied = (layer.truncate() * layer.w).extend(layer.w);
        sum += premultiplied * (1.0 - sum.w);
    }
    sum + ground * (1.0 - sum.w)
}

/// The blended triangles that may be seen in a view, found by walking the scene. They cover the pixels that they would if
/// they were opaque, so that an edge between the two kinds is drawn once.
///
/// Groups without blended surfaces are never entered, and what is outside the view is left out.
#[derive(Clone, Debug)]
pub struct BlendedTriangles<'a> {
    scene: &'a Scene,
    view: View,
    rays: Rays,
    instances: Vec<(Placed, ScreenFromObject)>,
    /// Ascending by first row.
    triangles: Vec<BlendedTriangle>,
}

#[derive(Clone, Debug)]
struct BlendedTriangle {
    id: SurfaceId,
    /// Index into the instances.
    placed: u32,
    first_row: u32,
    end_row: u32,
}

/// What a group or a mesh holds of blended surfaces.
#[derive(Clone, Copy, Debug)]
struct Holding {
    instances: u64,
    /// Around the blended surfaces alone; empty if there are none.
    blended: Aabb,
}

impl<'a> BlendedTriangles<'a> {
    /// Finds them. Cost: the stored nodes, the expanded nodes that lead to blended surfaces in the view, and
    /// the triangles there.
    pub fn find(scene: &'a Scene, view: &View) -> BlendedTriangles<'a> {
        let mut found = BlendedTriangles {
            scene,
            view: *view,
            rays: Rays::new(view),
            instances: Vec::new(),
            triangles: Vec::new(),
        };
        let meshes: Vec<Aabb> = scene.meshes.iter().map(|m| blended_bounds(scene, m)).collect();
        if meshes.iter().all(Aabb::is_empty) {
            return found;
        }
        let poses: Vec<Vec<DAffine3>> = scene.groups.iter().map(Group::world_transforms).collect();
        let mut groups: Vec<Holding> = Vec::with_capacity(scene.groups.len());
        let holding = |content: Content, groups: &[Holding]| match content {
            Content::Nothing => Holding { instances: 0, blended: Aabb::EMPTY },
            Content::Mesh(m) => Holding { instances: 1, blended: meshes[m as usize] },
            Content::Group(g) => groups[g as usize],
        };
        for (group, poses) in scene.groups.iter().zip(&poses) {
            let mut total = Holding { instances: 0, blended: Aabb::EMPTY };
            for (node, pose) in group.nodes.iter().zip(poses) {
                let inner = holding(node.content, &groups);
                total.instances = total.instances.saturating_add(inner.instances);
                total.blended = total.blended.union(&inner.blended.transformed(pose));
            }
            groups.push(total);
        }
        let mut stack =
            vec![(scene.root as usize, view.view_from_world, ScreenFromObject::of_view(view), 0u64)];
        while let Some((group, view_from_group, at, mut number)) = stack.pop() {
            for (node, pose) in scene.groups[group].nodes.iter().zip(&poses[group]) {
                let inner = holding(node.content, &groups);
                let view_from_node = view_from_group * *pose;
                if !inner.blended.is_empty() && may_be_seen(view, &inner.blended.transformed(&view_from_node))
                {
                    // Composed as where opaque surfaces are drawn, so that both are snapped alike.
                    let at = at.after(pose);
                    match node.content {
                        Content::Mesh(mesh) => {
                            found.add(number as u32, Placed { mesh, view_from_mesh: view_from_node }, at);
                        }
                        Content::Group(g) => stack.push((g as usize, view_from_node, at, number)),
                        Content::Nothing => {}
                    }
                }
                number += inner.instances;
            }
        }
        found.triangles.sort_by_key(|t| (t.first_row, t.id));
        found
    }

    fn add(&mut self, instance: u32, placed: Placed, screen_from_mesh: ScreenFromObject) {
        let at = self.instances.len() as u32;
        self.instances.push((placed, screen_from_mesh));
        let scene = self.scene;
        for primitive in &scene.meshes[placed.mesh as usize].primitives {
            if !scene.is_blended(primitive.material) {
                continue;
            }
            for triangle in primitive.triangles.clone() {
                let rows = self.footprint(at, triangle).rows();
                if !rows.is_empty() {
                    self.triangles.push(BlendedTriangle {
                        id: SurfaceId { instance, triangle },
                        placed: at,
                        first_row: rows.start,
                        end_row: rows.end,
                    });
                }
            }
        }
    }

    /// The pixels of a triangle, empty if it faces away.
    fn footprint(&self, placed: u32, triangle: u32) -> Footprint {
        let (Placed { mesh, .. }, at) = &self.instances[placed as usize];
        let mesh = &self.scene.meshes[*mesh as usize];
        let corners = mesh.triangles[triangle as usize].map(|v| mesh.positions[v as usize].to_array());
        let material = mesh.material_of(triangle);
        let two_sided = material.is_some_and(|m| self.scene.materials[m as usize].double_sided);
        Footprint::new(&corners, at, two_sided, (self.view.width, self.view.height))
    }

    /// Every fragment with its pixel centre in `rows` of the image, whatever lies before it.
    pub fn fragments(&self, rows: Range<u32>) -> Vec<Fragment> {
        let mut fragments = Vec::new();
        let begun = self.triangles.partition_point(|t| t.first_row < rows.end);
        for t in self.triangles[..begun].iter().filter(|t| t.end_row > rows.start) {
            let corners = self.instances[t.placed as usize].0.corners(self.scene, t.id.triangle);
            let in_view = TriangleInView::new(&self.rays, corners);
            let footprint = self.footprint(t.placed, t.id.triangle);
            for y in t.first_row.max(rows.start)..t.end_row.min(rows.end) {
                for x in footprint.columns(y) {
                    let distance = in_view.distance(in_view.weights(pixel_centre(x, y)));
                    if let Some(depth) = depth_at(&self.view.projection, distance) {
                        fragments.push(Fragment { pixel: y * self.view.width + x, depth, id: t.id });
                    }
                }
            }
        }
        fragments
    }
}

fn blended_bounds(scene: &Scene, mesh: &Mesh) -> Aabb {
    let blended = mesh.primitives.iter().filter(|p| scene.is_blended(p.material));
    let triangles =
        blended.flat_map(|p| &mesh.triangles[p.triangles.start as usize..p.triangles.end as usize]);
    Aabb::around(triangles.flatten().map(|&v| mesh.positions[v as usize].as_dvec3()))
}

/// False only if no point of the box in view space is in the picture.
fn may_be_seen(view: &View, bounds: &Aabb) -> bool {
    let (nearest, farthest) = (-bounds.max.z, -bounds.min.z);
    let half_height = f64::from(view.height) * 0.5 / view.pixels_per_unit();
    let half_width = f64::from(view.width) * 0.5 / view.pixels_per_unit();
    let reach = match view.projection {
        Projection::Perspective { near, .. } => {
            if farthest < near {
                return false;
            }
            farthest
        }
        Projection::Orthographic { near, far, .. } => {
            if farthest < near || nearest > far {
                return false;
            }
            1.0
        }
    };
    // A little larger than the picture: rounding must not lose its outermost pixels.
    let reach = reach * (1.0 + 1e-9);
    let outside = bounds.min.x > half_width * reach
        || bounds.max.x < -half_width * reach
        || bounds.min.y > half_height * reach
        || bounds.max.y < -half_height * reach;
    !outside
}

#[cfg(test)]
mod tests;
