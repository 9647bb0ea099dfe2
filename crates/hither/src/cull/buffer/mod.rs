//! The conservative occlusion buffer: what it calls hidden is hidden in the continuous image.
//!
//! # What is promised
//!
//! [`Verdict::Hidden`] means: every ray from the eye to a point of what was asked about meets an occluder
//! before that point. Whatever the resolution of the buffer, whatever the order of drawing; and what is hidden stays
//! hidden when more is drawn, for depths are only ever raised. The error is on the side of *visible*. Three
//! bounds carry it:
//!
//! - **coverage**: a pixel counts as covered only if all of its square is;
//! - **depth**: a pixel holds no more than the depth of the nearest surface anywhere in its square;
//! - **extent**: what is asked about is taken as the rectangle of all pixels whose closed squares it may touch,
//!   at the nearest depth it may reach.
//!
//! # Why edges inside a surface do not leak, and silhouettes do not hide too much
//!
//! An occluder is cut into *patches*, pieces connected by paired edges (two faces, opposite directions). On the
//! screen, the drawn faces of a patch all turn the same way, so together they are a chain whose boundary are the
//! edges that are not paired with a drawn face of the same turn: the silhouette, and where the surface ends.
//! Paired edges cancel. Let `N(q)` be how many faces cover a point q. N changes only across the boundary. Let c be
//! a pixel's centre and q any point of its square; the straight way from c to q crosses a boundary edge at most
//! once, and loses a layer only where it comes from the edge's inner side. So
//!
//! ```text
//! N(q) ≥ N(c) − (boundary edges that touch the square and have c on their inner side)
//! ```
//!
//! and where the right side is at least 1 the whole square is covered by the patch, if no single face covers it.
//! Counting N(c) takes the fill rule on snapped coordinates, exact in integers: a point on a shared edge belongs
//! to one of the two faces. A face all of whose edges near a pixel are boundary may be left out of the chain
//! there: its other edges do not come near, so nobody else's sum changes.
//!
//! *Snapping.* Corners are off by at most a slack of δ (1/256 pixel, more where f64 is not enough: see
//! `place`). Moving them to where they truly are is a homotopy of the chain. N at c changes only if an edge
//! passes over c; then c is within δ of it, the edge touches the square, and it has been taken off the count,
//! because *touches* widens the square by δ and *inner side* begins δ beyond the edge. An edge that passes over
//! c and is then crossed on the way to q gives back what it took. A face that snapping turned over counts as it
//! lies: N becomes a sum with signs, and where that is at least 1, a face that truly turns this way is there.
//!
//! *Depth.* Every face of the chain that may touch the square, widened by δ, takes part in the minimum. Of a face,
//! the plane through three snapped corners is lowered until it is below every true corner. A true point of the face
//! is a mean of true corners, hence not below the plane there; within a pixel and δ the plane falls by at most
//! `(|a| + |b|)·(½ + δ)`. Where several faces cover pixels together, the minimum is taken over blocks of 4×4: over all
//! faces that may touch the block, and of each over all of the block within the rectangle around the face. So each
//! pixel's faces are among them, and none is taken for nearer than it is.
//!
//! *Cutting* at the near plane and at the guard band replaces the chain by another with the same cut points for
//! both owners of an edge; what the near plane cuts ends there.
//!
//! # Five ways to draw a patch
//!
//! All rest on the same inequality; they differ in what they need not look at. A patch of one face ends at every
//! edge, so a pixel is covered where it lies inside all of them (`loose`); of a closed convex patch, wholly beyond the
//! near plane, where it lies inside all edges of the silhouette (`silhouette`): its depth is that of the planes of its
//! faces, pixel by pixel if they are few (`convex`), over blocks if they are many (`round`). In a patch of faces
//! that are not large N(c) is counted from the outline alone, and each face lowers depth in the whole rectangle
//! around it, to its plane or to its farthest corner (`mosaic`). Else each face is filled, and only pixels that
//! shared edges cross are counted (`fill`). In both, whole blocks that are covered raise one number, and only what is
//! covered in part raises pixels.
//!
//! Any choice of a patch's faces is a chain, with an outline of its own. A patch that lies before itself is drawn in
//! such parts (`parts`), lest what is near hide only at the depth of what is behind it.
//!
//! The names in brackets are of the files that draw so.
//!
//! What of a closed patch is not worth drawing may still hide by boxes that lie inside of it (`inner`): from outside
//! the patch's bounding box, what such a box hides, the patch hides.
//!
//! # Sampled
//!
//! Asked with [`Meaning::Sampled`], the extent of a box are only the pixels whose centres it may hold, moved by no
//! more than 1/256 pixel as a rasteriser snaps corners. What a pixel holds is true of its whole square, hence of
//! its centre; and there, by the fill rule on snapped corners, at least one face of the patch is drawn. So it is where a
//! box inside of a closed patch covers the square: the square, at the depth that is kept, lies inside of the patch, whose
//! surface snapping moves across the image by less than the half pixel from there to the centre. The centre at that
//! depth stays inside, and the surface before it.
//!
//! # A moving eye
//!
//! With a margin of r metres a patch is eroded by ρ pixels, and each pixel takes the least depth within ρ, where
//! ρ bounds how far on the image a displacement of r can move a point no nearer than the patch. As far as the numbers
//! allow, that is a slack of δ + ρ instead of δ in all that is said above of squares and faces. Let e be the
//! eye of the buffer, e' within r of it, b hidden. A point x' of the segment e'b is within r of the point x of eb
//! that divides it alike, and x lies on b's ray. As long as x' is no nearer than the nearest point of the patch,
//! it is within ρ pixels of b on e's image, where the patch covers everything at least once and lies wholly
//! before b. Going from b towards e', x' begins behind the patch and ends before it, and all the while stays
//! where N ≥ 1: it crosses the patch. Motion of an occluder by m adds m to r; boxes are widened by 2m.
//!
//! The near plane, and an orthographic view's far one, go with the eye. What of a patch is within r of the near plane
//! does not count, for e' may have that behind it; what lies before the near plane or beyond the far one is outside only
//! if it does so by more than r. In perspective a patch is cut there by a plane across the view: what lies beyond is a
//! surface of its own that ends at the cut, the same for e and e'. So is what lies beyond any other such plane, and as
//! its nearest point is farther away, its ρ is less: a surface that goes far is drawn several times (`pass`).
//!
//! Of something that the image's border cuts, e' may see some that e does not: by no more than ρ, now of what is asked
//! about. A buffer that has a border of its own around the image answers for that, where ρ is less than the border.

mod ask;
mod clip;
mod convex;
mod draw;
mod fill;
mod fine;
mod inner;
mod loose;
mod mosaic;
mod occludee;
mod occluder;
mod parts;
mod pass;
mod place;
mod queries;
mod round;
mod sampled;
mod shared;
mod silhouette;
mod surface;
mod tile;
mod worth;

pub(super) use ask::{BoxView, BoxesOnScreen, project_lanes};
pub(super) use draw::Band;
pub use occludee::{Occludee, PlacedMesh};
pub use occluder::{Occluder, OccluderError, Sides};
pub use queries::{Ball, Boxes, ScreenRect};
pub use sampled::SampledBuffer;
pub use shared::SharedBuffer;

use super::{Meaning, Verdict};
use crate::conventions::{Projection, View, ViewError};
use crate::raster::ScreenFromObject;
use draw::Standing;
use fearless_simd::{Level, dispatch};
use glam::DAffine3;
use place::Sizes;

/// What may be chosen about an [`OcclusionBuffer`].
#[derive(Clone, Copy, Debug)]
pub struct OcclusionOptions {
    /// How far the eye may move, metres, while answers are to stay true. It must not turn: the view has borders.
    ///
    /// # A frame of latency
    ///
    /// Where the picture is drawn after the camera has gone on, moving by up to r metres and turning by up to φ about
    /// any axis through the eye, ask a buffer of a wider view. With h and v half the fields of view of the picture, the
    /// halves of the wider view, at the same place and turn, are
    ///
    /// ```text
    /// h' = h + asin(sin φ · √(1 + tan²v · cos²h))
    /// v' = v + asin(sin φ · √(1 + tan²h · cos²v))
    /// ```
    ///
    /// A direction of the picture in its corner is what comes nearest to the turned border, so that adding φ to each
    /// half, 2φ to each field of view, is not enough. A near plane that turns cuts differently, too: with the same
    /// `near`, `eye_moves` is r + near · (√(1 + tan²h' + tan²v') − 1). For then an occluder counts only if it is no
    /// nearer than near / cos Θ + r, Θ being half the wider view's diagonal, and so lies beyond the turned near plane
    /// wherever the picture shows it; and what the picture shows, beyond near · cos Θ − r, is not taken for outside.
    ///
    /// ```
    /// use hither::conventions::{Projection, View};
    ///
    /// /// The view to cull with, and its `eye_moves`. None if it would see half of space or more.
    /// fn with_latency(view: &View, turns: f64, moves: f64) -> Option<(View, f64)> {
    ///     let Projection::Perspective { fov_y, near } = view.projection else { return None };
    ///     let v = fov_y / 2.0;
    ///     let h = (v.tan() * f64::from(view.width) / f64::from(view.height)).atan();
    ///     let wider = |half: f64, other: f64| {
    ///         half + (turns.sin() * (1.0 + (other.tan() * half.cos()).powi(2)).sqrt()).asin()
    ///     };
    ///     let (h, v) = (wider(h, v), wider(v, h));
    ///     let in_range = |half: f64| half < std::f64::consts::FRAC_PI_2;
    ///     if !(turns >= 0.0 && in_range(h) && in_range(v)) {
    ///         return None;
    ///     }
    ///     // Pixels are square: the width says how wide the view is.
    ///     let width = (f64::from(view.height) * h.tan() / v.tan()).ceil();
    ///     let wide = width / f64::from(view.height) * v.tan();
    ///     let moves = moves + near * ((1.0 + wide.powi(2) + v.tan().powi(2)).sqrt() - 1.0);
    ///     let projection = Projection::Perspective { fov_y: 2.0 * v, near };
    ///     Some((View { projection, width: width as u32, ..*view }, moves))
    /// }
    /// # use glam::{DMat3, DVec3};
    /// # let projection = Projection::Perspective { fov_y: 1.2, near: 0.1 };
    /// # let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, (1920, 1080));
    /// # let halves = |view: &View| {
    /// #     let Projection::Perspective { fov_y, .. } = view.projection else { unreachable!() };
    /// #     let v = (fov_y / 2.0).tan();
    /// #     (v * f64::from(view.width) / f64::from(view.height), v)
    /// # };
    /// # let (x, y) = halves(&view);
    /// # let (mut reached, mut by_twice_the_turn) = (0.0_f64, 0.0_f64);
    /// # for turn in [0.01, 0.05, 0.2] {
    /// #     let (wide, margin) = with_latency(&view, turn, 0.5).unwrap();
    /// #     assert!(wide.validate().is_ok() && margin > 0.5);
    /// #     let (wide_x, wide_y) = halves(&wide);
    /// #     for i in 0..10_000 {
    /// #         let (a, b) = (f64::from(i % 100) * 0.0628, f64::from(i / 100) * 0.0314);
    /// #         let axis = DVec3::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos());
    /// #         let corner = DMat3::from_axis_angle(axis, turn) * DVec3::new(x, y, -1.0);
    /// #         let (to_x, to_y) = (corner.x / -corner.z, corner.y / -corner.z);
    /// #         assert!(to_x <= wide_x * (1.0 + 1e-12) && to_y <= wide_y * (1.0 + 1e-12), "{turn} {axis}");
    /// #         reached = reached.max(to_y / wide_y);
    /// #         by_twice_the_turn = by_twice_the_turn.max(to_y / (y.atan() + turn).tan());
    /// #     }
    /// # }
    /// # assert!(reached > 0.999 && by_twice_the_turn > 1.01, "{reached} {by_twice_the_turn}");
    /// ```
    pub eye_moves: f64,
    /// How far each object, occluder or not, may move, metres, while answers are to stay true.
    pub objects_move: f64,
    /// Instruction set; the best that the machine has by default. Answers do not depend on it.
    pub level: Level,
}

impl Default for OcclusionOptions {
    fn default() -> Self {
        OcclusionOptions { eye_moves: 0.0, objects_move: 0.0, level: Level::new() }
    }
}

/// What drawing an occluder came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Connected pieces that were drawn.
    pub patches: u64,
    /// Boxes around pieces that were found hidden beforehand.
    pub hidden: u64,
    /// Faces (triangles, and pairs of them that form a quadrilateral) that were drawn.
    pub faces: u64,
}

impl std::ops::AddAssign for Drawn {
    fn add_assign(&mut self, o: Drawn) {
        self.patches += o.patches;
        self.hidden += o.hidden;
        self.faces += o.faces;
    }
}

/// The views differ, or the margins, or how the image is cut into bands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("two occlusion buffers can be merged only if they have the same view, margins and bands")]
pub struct CannotMerge;

/// A conservative occlusion buffer: draw occluders, ask what they hide, in any order. See
/// [the module's page](crate::cull::buffer) for what *hidden* means and why it is true.
///
/// Asking takes `&self`, so any number of threads may ask at once; [`SharedBuffer`] lets them draw meanwhile.
#[derive(Clone, Debug)]
pub struct OcclusionBuffer {
    frame: Frame,
    band: Band,
}

/// How far things and the eye may come nearer to each other, or go apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Margin {
    /// Units of view space.
    pub metres: f64,
    /// Pixels that a unit at distance 1 covers anywhere in the image.
    pub pixels: f64,
    /// What an orthographic depth changes by over so far; 0 in perspective.
    pub depth: f64,
}

/// What all bands of an image share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub view: View,
    pub options: OcclusionOptions,
    /// What boxes are asked about.
    pub meaning: Meaning,
    pub screen_from_world: ScreenFromObject,
    /// How far, in units of view space, what is drawn and the eye may come nearer to each other.
    moves: f64,
    /// Pixels that a metre at distance 1 covers anywhere in the image.
    pixels_a_metre: f64,
    /// How many of the whole view's pixels go across and down one of `view`.
    pub coarseness: u32,
    /// Pixels on each side that are not of the image: what an eye that comes may see there is drawn, too.
    border: u32,
}

impl Frame {
    pub(super) fn new(view: &View, options: &OcclusionOptions) -> Result<Frame, ViewError> {
        view.validate()?;
        let moves = [options.eye_moves, options.objects_move];
        if !moves.iter().all(|m| m.is_finite() && *m >= 0.0) {
            return Err(ViewError::Camera("what moves must move by a finite distance that is not negative"));
        }
        let screen_from_world = ScreenFromObject::of_view(view);
        let pixels_a_metre = pixels_a_metre(view, 0);
        Ok(Frame {
            view: *view,
            options: *options,
            meaning: Meaning::Continuous,
            screen_from_world,
            moves: (options.eye_moves + options.objects_move) * view.stretch(),
            pixels_a_metre,
            coarseness: 1,
            border: 0,
        })
    }

    /// The same, asked with another meaning. Samples stay where they are only as long as nothing moves.
    pub(super) fn meaning(self, meaning: Meaning) -> Result<Frame, ViewError> {
        if meaning == Meaning::Sampled && self.margin().is_some() {
            return Err(ViewError::Camera("what is sampled holds for this eye alone: it has no margin"));
        }
        Ok(Frame { meaning, ..self })
    }

    /// The same with pixels `n` times as wide and as high. They are counted from the image's top left corner, so that
    /// each is a square of n×n of the view's, and what is seen is the same at the same place; at the right and at the
    /// bottom the last may reach beyond the view. So this shows all that the view shows, and what it calls hidden or
    /// outside is so in the view: nothing that is promised depends on the size of pixels. Boxes may be asked about,
    /// and nothing else: `view` keeps the projection of the whole.
    ///
    /// With a margin it also gets a border of [`BORDER`] such pixels on each side.
    pub(in crate::cull) fn coarser(mut self, n: u32) -> Result<Frame, ViewError> {
        let border = if self.margin().is_some() { BORDER } else { 0 };
        if n == 1 && border == 0 {
            return Ok(self);
        }
        if n == 0 {
            return Err(ViewError::Camera(
                "the pixels of what culls must be at least as large as the view's",
            ));
        }
        if self.meaning == Meaning::Sampled {
            return Err(ViewError::Camera("what is sampled needs the view's own pixels, not coarser ones"));
        }
        // Larger ones than any image hold no more of it; so the border's pixels are a number.
        let n = n.min(LARGEST_PIXEL);
        let beyond = border * n;
        self.pixels_a_metre = pixels_a_metre(&self.view, beyond + (n - 1)) / f64::from(n);
        self.screen_from_world = ScreenFromObject::of_view_with_border(&self.view, beyond);
        // Rounded once more where n is no power of two: 2⁻⁵³ of each term, as any matrix on the way here.
        for row in [&mut self.screen_from_world.x, &mut self.screen_from_world.y] {
            *row = row.map(|c| c / f64::from(n));
        }
        let size = |side: u32| side.div_ceil(n) + 2 * border;
        (self.view.width, self.view.height) = (size(self.view.width), size(self.view.height));
        (self.coarseness, self.border) = (n, border);
        Ok(self)
    }

    /// How far what is drawn and the eye may come nearer to each other, if they may.
    pub(super) fn margin(&self) -> Option<Margin> {
        let depth = match self.view.projection {
            Projection::Orthographic { near, far, .. } => self.moves / (far - near) * (1.0 + 1e-12),
            Projection::Perspective { .. } => 0.0,
        };
        (self.moves > 0.0).then_some(Margin { metres: self.moves, pixels: self.pixels_a_metre, depth })
    }

    fn standing<'a>(&self, occluder: &'a Occluder, world_from_object: &DAffine3) -> Standing<'a> {
        self.standing_at(occluder, self.screen_from_world.after(world_from_object))
    }

    pub(super) fn standing_at<'a>(&self, occluder: &'a Occluder, at: ScreenFromObject) -> Standing<'a> {
        let boxes = BoxView::new(&at, self.view.width, self.view.height);
        let sizes = Sizes::new(&at, occluder.reach);
        // What touches two columns covers none of them; unless there are but two.
        let least_px = 2.min(self.view.width.min(self.view.height) as i32 - 1);
        let eye = mosaic::eye_in_object(&at);
        Standing {
            occluder,
            at,
            eye,
            boxes,
            sizes,
            margin: self.margin(),
            size: [self.view.width as i32, self.view.height as i32],
            least_px,
            px_a_face: 0,
            plain: false,
        }
    }
}

/// Pixels on each side of an image with a margin. What is cut by the image's border and so far away that it moves by no
/// more can be hidden.
const BORDER: u32 = 32;

/// No image is wider or higher.
const LARGEST_PIXEL: u32 = 1 << 16;

/// Pixels that a metre at distance 1 covers anywhere in an image that goes on for `beyond` pixels at the right and at
/// the bottom.
fn pixels_a_metre(view: &View, beyond: u32) -> f64 {
    let scale = view.pixels_per_unit();
    match view.projection {
        Projection::Orthographic { .. } => scale,
        Projection::Perspective { .. } => {
            let half = (f64::from(view.width.max(view.height)) * 0.5 + f64::from(beyond)) / scale;
            // Both directions across the image, and along the ray.
            scale * (1.0 + half * half).sqrt()
        }
    }
}

impl OcclusionBuffer {
    /// An empty buffer for `view`, of its size.
    pub fn new(view: &View, options: &OcclusionOptions) -> Result<OcclusionBuffer, ViewError> {
        let frame = Frame::new(view, options)?;
        Ok(OcclusionBuffer { frame, band: Band::new(view.width, 0, view.height) })
    }

    /// Empties the buffer and looks from another view. Keeps its memory if the size stays.
    pub fn look(&mut self, view: &View) -> Result<(), ViewError> {
        let frame = Frame::new(view, &self.frame.options)?;
        if (view.width, view.height) == (self.frame.view.width, self.frame.view.height) {
            self.band.surface.clear();
        } else {
            self.band = Band::new(view.width, 0, view.height);
        }
        self.frame = frame;
        Ok(())
    }

    /// Makes the buffer empty. Cost: a byte or two a pixel block, not the pixels.
    pub fn clear(&mut self) {
        self.band.surface.clear();
    }

    /// The view it was made for.
    pub fn view(&self) -> &View {
        &self.frame.view
    }

    /// What was chosen.
    pub fn options(&self) -> &OcclusionOptions {
        &self.frame.options
    }

    /// Draws an occluder. `world_from_object` may be any affine map; one that mirrors keeps fronts fronts.
    pub fn draw(&mut self, occluder: &Occluder, world_from_object: &DAffine3) -> Drawn {
        let standing = self.frame.standing(occluder, world_from_object);
        let mut drawn = Drawn::default();
        let band = &mut self.band;
        dispatch!(self.frame.options.level, simd => band.draw(simd, &standing, &mut drawn));
        drawn
    }

    /// Adds what another buffer of the same view holds: afterwards, what either hid is hidden.
    pub fn merge(&mut self, other: &OcclusionBuffer) -> Result<(), CannotMerge> {
        let (a, b) = (&self.frame, &other.frame);
        let moves = |f: &Frame| (f.options.eye_moves, f.options.objects_move);
        if a.view != b.view || moves(a) != moves(b) {
            return Err(CannotMerge);
        }
        let surface = &mut self.band.surface;
        dispatch!(self.frame.options.level, simd => surface.merge(simd, &other.band.surface));
        Ok(())
    }

    /// What pixel (x, y) holds: all of it is covered at this depth or nearer; 0 where it is not covered.
    pub fn depth(&self, x: u32, y: u32) -> f32 {
        self.band.surface.depth(x, y)
    }

    /// All depths, row by row.
    pub fn depths(&self) -> Vec<f32> {
        let view = &self.frame.view;
        (0..view.height)
            .flat_map(|y| (0..view.width).map(move |x| (x, y)))
            .map(|(x, y)| self.depth(x, y))
            .collect()
    }
}

#[cfg(test)]
mod tests;
