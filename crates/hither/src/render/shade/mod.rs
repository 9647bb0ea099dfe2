//! Shading, deferred: once a pixel, from the ids and depth of a finished frame, then blended surfaces over it.
//!
//! The picture does not depend on the number of threads. Where nothing is seen it is transparent.

mod false_color;
#[cfg(test)]
pub(super) mod fixture;
mod light;
mod surface;
#[cfg(test)]
mod tests;
mod triangle;

pub use false_color::{COMPLEXITY_WHITE, ComplexityPanel, complexity_image, complexity_panels};
pub(super) use light::Light;
pub(super) use surface::{Normals, Placed, PlacedInstances, SeenTriangle, Setting, instances_among};
pub(super) use triangle::{Rays, TriangleInView, depth_at};

use super::Frame;
use super::blend::{BlendedTriangles, Fragment, composite, instances_that_show};
use crate::conventions::{NO_ID, SurfaceId, View};
use crate::index::SceneIndex;
use crate::scene::{InstanceLocator, Scene, TexturePyramids};
use false_color::{DepthRange, id_color, normal_color};
use glam::DVec2;
use rayon::prelude::*;
use std::ops::Range;

/// How a picture is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// Base colour, lit on the face's own plane.
    Flat,
    /// Base colour, lit on interpolated normals where the mesh has them.
    #[default]
    Smooth,
    /// A colour for each instance, a little lighter or darker from triangle to triangle.
    Ids,
    /// Distance as grey, near white, over the range that the frame shows.
    Depth,
    /// World-space normals as colours, on the side that is seen.
    Normals,
    /// Log-scale picture of where the work was done [Greene 1995, fig. 3.8]; all transparent if the frame
    /// did not record it.
    Complexity,
}

impl Shading {
    /// Whether blended surfaces show: they tint what is lit, and leave ids and measurements alone.
    pub fn shows_blended(self) -> bool {
        matches!(self, Shading::Flat | Shading::Smooth)
    }

    fn normals(self) -> Normals {
        if self == Shading::Flat { Normals::Face } else { Normals::Vertices }
    }
}

/// A picture: rows from the top, linear premultiplied RGBA.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Row by row.
    pub pixels: Vec<[f32; 4]>,
}

/// Shades a finished frame of `index` in its present pose.
///
/// For a sequence of frames keep a [`Shader`], which prefilters textures once.
pub fn shade(index: &SceneIndex, frame: &Frame, shading: Shading) -> Image {
    Shader::new(index.scene(), 0).shade(index.scene(), frame, shading)
}

/// Shades frames of one scene and keeps what is the same in all of them: prefiltered textures, the numbering
/// of instances. The scene may be posed anew between frames.
#[derive(Debug)]
pub struct Shader {
    locator: InstanceLocator,
    pyramids: TexturePyramids,
    threads: Option<rayon::ThreadPool>,
}

impl Shader {
    /// A shader for `scene` on `threads` worker threads; 0 means those that rayon has anyway.
    pub fn new(scene: &Scene, threads: usize) -> Shader {
        let pool = || rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok();
        Shader {
            locator: InstanceLocator::new(scene),
            pyramids: TexturePyramids::new(scene),
            threads: if threads == 0 { None } else { pool() },
        }
    }

    /// Shades `frame`, which must be of `scene` in its present pose.
    pub fn shade(&mut self, scene: &Scene, frame: &Frame, shading: Shading) -> Image {
        self.shade_within(scene, frame, shading, &Window::of(&frame.view))
    }

    /// As [`Shader::shade`], of a part of the picture: its rows, transparent beyond its columns.
    pub(crate) fn shade_within(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        shading: Shading,
        window: &Window,
    ) -> Image {
        let blended = shading.shows_blended().then(|| BlendedTriangles::find(scene, &frame.view));
        let fragments = |rows| blended.as_ref().map_or_else(Vec::new, |blended| blended.fragments(rows));
        self.on_threads(|shader| shader.shade_here(scene, frame, shading, window, &fragments))
    }

    /// As [`Shader::shade`], with the fragments of blended surfaces found by the caller: `fragments(rows)`
    /// returns, in any order, at least those in front of the frame's surfaces with a pixel centre in the
    /// rows, one a surface and pixel.
    pub fn shade_with(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        shading: Shading,
        fragments: impl Fn(Range<u32>) -> Vec<Fragment> + Sync,
    ) -> Image {
        let all = Window::of(&frame.view);
        self.on_threads(|shader| shader.shade_here(scene, frame, shading, &all, &fragments))
    }

    /// The blended instances that show in `frame`, which must be of `scene` in its present pose: at some pixel centre
    /// a surface of theirs is before what is opaque or masked, and its alpha is above 0. Ascending by number, each
    /// with the depth of its nearest such point. Blended surfaces do not hide each other, not even where alpha is 1.
    pub fn blended_instances(&mut self, scene: &Scene, frame: &Frame) -> Vec<(u32, f32)> {
        let blended = BlendedTriangles::find(scene, &frame.view);
        self.on_threads(|shader| {
            shader.prepare_blended_textures(scene);
            let setting = shader.setting(scene, frame, Shading::Flat);
            instances_that_show(&setting, frame, &shader.locator, &|rows| blended.fragments(rows))
        })
    }

    fn on_threads<T: Send>(&mut self, work: impl FnOnce(&mut Shader) -> T + Send) -> T {
        let threads = self.threads.take();
        let made = match &threads {
            Some(pool) => pool.install(|| work(self)),
            None => work(self),
        };
        self.threads = threads;
        made
    }

    /// What `frame` is shaded with, once the textures of all that is shaded are prepared.
    fn setting<'a>(&'a self, scene: &'a Scene, frame: &Frame, shading: Shading) -> Setting<'a> {
        Setting {
            scene,
            rays: Rays::new(&frame.view),
            light: Light::new(frame.view.view_from_world.matrix3),
            normals: shading.normals(),
            pyramids: &self.pyramids,
        }
    }

    fn shade_here(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        shading: Shading,
        window: &Window,
        fragments: &(impl Fn(Range<u32>) -> Vec<Fragment> + Sync),
    ) -> Image {
        match shading {
            Shading::Complexity => {
                let whole = complexity_image(frame, ComplexityPanel::Sum);
                return window.picture(&frame.view, |row, x, y| {
                    let at = y as usize * frame.view.width as usize + x as usize;
                    whole.iter().for_each(|whole| row.copy_from_slice(&whole.pixels[at..][..row.len()]));
                });
            }
            Shading::Ids => {
                return each_pixel(frame, window, || {
                    let mut last = (SurfaceId { instance: NO_ID, triangle: NO_ID }, [0.0; 4]);
                    move |_, _, id| {
                        if last.0 != id {
                            last = (id, id_color(id));
                        }
                        last.1
                    }
                });
            }
            Shading::Depth => {
                let range = DepthRange::of(frame);
                return each_pixel(frame, window, || |x, y, _| range.color(frame.distance(x, y)));
            }
            Shading::Flat | Shading::Smooth | Shading::Normals => {}
        }
        let instances = self.instances_in(scene, frame, window);
        self.prepare_textures(scene, instances.meshes());
        if shading.shows_blended() {
            self.prepare_blended_textures(scene);
        }
        let setting = self.setting(scene, frame, shading);
        let mut image = shade_opaque(&setting, frame, shading, &instances, window);
        if shading.shows_blended() {
            composite(&mut image, window.rows.start, &setting, frame, &self.locator, fragments);
        }
        image
    }

    fn instances_in(&self, scene: &Scene, frame: &Frame, window: &Window) -> PlacedInstances {
        let rows = window.rows.clone().into_par_iter();
        let numbers = rows.flat_map_iter(|y| {
            let mut row = instances_among(window.columns.clone().filter_map(|x| frame.id(x, y)));
            row.sort_unstable();
            row.dedup();
            row
        });
        PlacedInstances::look_up(numbers.collect(), scene, &self.locator, &frame.view)
    }

    fn prepare_textures(&mut self, scene: &Scene, meshes: impl Iterator<Item = u32>) {
        if scene.textures.is_empty() {
            return;
        }
        let mut meshes: Vec<u32> = meshes.collect();
        meshes.sort_unstable();
        meshes.dedup();
        let primitives = meshes.iter().flat_map(|&m| &scene.meshes[m as usize].primitives);
        self.pyramids.prepare(scene, primitives.filter_map(|p| p.material));
    }

    fn prepare_blended_textures(&mut self, scene: &Scene) {
        let blended = (0..scene.materials.len() as u32).filter(|&m| scene.is_blended(Some(m)));
        self.pyramids.prepare(scene, blended);
    }
}

/// The middle of pixel (x, y), in pixels.
pub(super) fn pixel_centre(x: u32, y: u32) -> DVec2 {
    DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
}

/// A part of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Window {
    /// Columns of pixels.
    pub columns: Range<u32>,
    /// Rows of pixels.
    pub rows: Range<u32>,
}

impl Window {
    /// All of a view's picture.
    pub fn of(view: &View) -> Window {
        Window { columns: 0..view.width, rows: 0..view.height }
    }

    /// The window's rows, whose columns in it `shade` colours, given the first column's number and the row's.
    fn picture(&self, view: &View, shade: impl Fn(&mut [[f32; 4]], u32, u32) + Sync) -> Image {
        let (width, height) = (view.width, self.rows.len() as u32);
        let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
        pixels.par_chunks_mut(width as usize).zip(self.rows.clone()).for_each(|(row, y)| {
            let columns = self.columns.start as usize..self.columns.end as usize;
            shade(&mut row[columns], self.columns.start, y);
        });
        Image { width, height, pixels }
    }
}

/// A picture whose every row is coloured, from left to right, by a closure of its own.
fn each_pixel<F: FnMut(u32, u32, SurfaceId) -> [f32; 4]>(
    frame: &Frame,
    window: &Window,
    row: impl Fn() -> F + Sync,
) -> Image {
    window.picture(&frame.view, |pixels, first, y| {
        let mut color = row();
        for (pixel, x) in pixels.iter_mut().zip(first..) {
            if let Some(id) = frame.id(x, y) {
                *pixel = color(x, y, id);
            }
        }
    })
}

fn shade_opaque(
    setting: &Setting,
    frame: &Frame,
    shading: Shading,
    instances: &PlacedInstances,
    window: &Window,
) -> Image {
    let world_from_view = frame.view.view_from_world.matrix3.transpose();
    window.picture(&frame.view, |row, first, y| {
        let mut last: Option<(SurfaceId, SeenTriangle)> = None;
        for (pixel, x) in row.iter_mut().zip(first..) {
            let Some(id) = frame.id(x, y) else { continue };
            let (_, seen) = match last.take() {
                Some(same) if same.0 == id => last.insert(same),
                _ => {
                    let placed = instances.get(id.instance);
                    last.insert((id, SeenTriangle::new(setting, placed, id.triangle)))
                }
            };
            let at = pixel_centre(x, y);
            *pixel = match shading {
                Shading::Normals => normal_color(world_from_view * seen.normal(at)),
                // What is seen is opaque, whatever its alpha.
                _ => seen.color(setting, at).truncate().extend(1.0).to_array(),
            };
        }
    })
}
