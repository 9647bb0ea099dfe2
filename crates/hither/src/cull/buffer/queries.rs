//! Asking: boxes in batches, single boxes, spheres, rectangles of the screen, other meshes.

use super::ask::{BoxView, BoxesOnScreen, project};
use super::draw::Band;
use super::{Frame, Margin, Occludee, OcclusionBuffer, PlacedMesh, Verdict};
use crate::conventions::{Projection, View};
use crate::cull::Meaning;
use crate::geometry::Aabb;
use crate::index::{Box3, middle_of};
use crate::raster::ScreenFromObject;
use fearless_simd::{Simd, dispatch};
use glam::{DAffine3, DVec3};

/// Boxes to ask about, sixteen together. f32, rounded outwards, about an origin: boxes that are collected find one, where
/// they lie together far from the world's, and others are told ([`Boxes::about`]).
///
/// A box with a corner that is no finite number, or beyond 10¹⁵ metres, is never hidden; nor is one whose
/// smallest coordinates exceed its largest.
#[derive(Clone, Debug, Default)]
pub struct Boxes {
    pub(super) sixteen: Vec<SixteenBoxes>,
    len: usize,
    origin: DVec3,
}

#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct SixteenBoxes {
    pub min: [[f32; 16]; 3],
    pub max: [[f32; 16]; 3],
}

impl Boxes {
    /// No boxes yet. What is kept of them is kept about `origin`: in a country's coordinates, 5,000 km from the world's
    /// origin, f32 tells half a metre, and about the middle of a town tenths of a millimetre.
    pub fn about(origin: DVec3) -> Boxes {
        Boxes { origin, ..Boxes::default() }
    }

    /// No boxes yet, about the same origin.
    pub(super) fn like_these(&self) -> Boxes {
        Boxes::about(self.origin)
    }

    /// To the screen from the space in which they are kept.
    pub(super) fn screen_from_boxes(&self, screen_from_world: &ScreenFromObject) -> ScreenFromObject {
        match self.origin == DVec3::ZERO {
            true => *screen_from_world,
            false => screen_from_world.after(&DAffine3::from_translation(self.origin)),
        }
    }

    /// Adds a box.
    pub fn push(&mut self, bounds: &Aabb) {
        let lane = self.len % 16;
        if lane == 0 {
            self.sixteen.push(SixteenBoxes { min: [[0.0; 16]; 3], max: [[0.0; 16]; 3] });
        }
        self.len += 1;
        let b = Box3::about(bounds, self.origin);
        if let Some(sixteen) = self.sixteen.last_mut() {
            for axis in 0..3 {
                sixteen.min[axis][lane] = b.min[axis];
                sixteen.max[axis][lane] = b.max[axis];
            }
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Largest magnitudes of the coordinates of those that are boxes.
    pub(super) fn reach(&self) -> [f64; 3] {
        let mut reach = [0.0f32; 3];
        for sixteen in &self.sixteen {
            for lane in (0..16).filter(|&lane| sixteen.is_box(lane)) {
                for (axis, reach) in reach.iter_mut().enumerate() {
                    let (low, high) = (sixteen.min[axis][lane], sixteen.max[axis][lane]);
                    *reach = reach.max(low.abs()).max(high.abs());
                }
            }
        }
        reach.map(f64::from)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Forgets all, but not the origin.
    pub fn clear(&mut self) {
        self.sixteen.clear();
        self.len = 0;
    }
}

impl FromIterator<Aabb> for Boxes {
    fn from_iter<T: IntoIterator<Item = Aabb>>(bounds: T) -> Boxes {
        let bounds: Vec<Aabb> = bounds.into_iter().collect();
        let mut boxes = Boxes::about(middle_of(bounds.len(), |i| bounds[i]));
        bounds.iter().for_each(|b| boxes.push(b));
        boxes
    }
}

/// A rectangle of the screen at a depth, in pixels of the image; it may reach beyond it. It stands for an object that is
/// seen in it now, and that may move where objects may.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenRect {
    /// Left border.
    pub left: f64,
    /// Top border.
    pub top: f64,
    /// Right border.
    pub right: f64,
    /// Bottom border.
    pub bottom: f64,
    /// The nearest it comes: [`Projection`] says how depth is counted. 0 is infinitely far in a perspective view, as a sky
    /// is, and outside of an orthographic one.
    pub depth: f32,
}

/// A ball of world space to ask about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre.
    pub center: DVec3,
    /// Its radius, metres.
    pub radius: f64,
}

impl Ball {
    /// The rectangle around it on the screen and the nearest it comes; what is to be said of it where it has none. With a
    /// margin it is outside only if it is so for every eye that may come.
    pub(super) fn on_screen(&self, view: &View, margin: Option<Margin>) -> Result<ScreenRect, Verdict> {
        let c = view.view_from_world.transform_point3(self.center);
        let stretch = view.stretch();
        let size = self.center.length() * stretch + view.view_from_world.translation.abs().max_element();
        // Rounding of the transform, and of what follows.
        let radius = self.radius.abs() * stretch + size * 1e-12;
        if !(c.is_finite() && radius.is_finite()) {
            return Err(Verdict::Visible);
        }
        let scale = view.pixels_per_unit();
        let (beyond, beyond_in_depth) = margin.map_or((0.0, 0.0), |margin| (margin.metres, margin.depth));
        let (x, y, depth) = match view.projection {
            Projection::Perspective { near, .. } => {
                let distance = -c.z;
                if distance + radius < near - beyond {
                    return Err(Verdict::Outside);
                }
                if distance - radius <= near {
                    return Err(Verdict::Visible);
                }
                // Tangents from the eye to the circle in which the axis' plane through the eye cuts the ball, the one
                // nearer to the axis by way of its conjugate: all sums are of numbers of one sign.
                let below = (distance - radius) * (distance + radius);
                let tangents = |a: f64| {
                    let (from_axis, long) = (a.abs(), (a * a + below).sqrt() * radius);
                    let far = (from_axis * distance + long) / below;
                    let near = (from_axis - radius) * (from_axis + radius) / (from_axis * distance + long);
                    let sides = if a < 0.0 { [-far, -near] } else { [near, far] };
                    sides.map(|side| side * scale)
                };
                (tangents(c.x), tangents(-c.y), near / (distance - radius))
            }
            Projection::Orthographic { near, far, .. } => {
                let depth = (far + c.z + radius) / (far - near);
                let tangents = |a: f64| [(a - radius) * scale, (a + radius) * scale];
                if depth > 1.0 {
                    let wholly = (far + c.z - radius) / (far - near) > 1.0 + beyond_in_depth;
                    return Err(if wholly { Verdict::Outside } else { Verdict::Visible });
                }
                (tangents(c.x), tangents(-c.y), depth)
            }
        };
        let (w, h) = (f64::from(view.width) * 0.5, f64::from(view.height) * 0.5);
        let slack = 1e-6 + 1e-9 * (x[0].abs() + x[1].abs() + y[0].abs() + y[1].abs());
        let depth = (depth * (1.0 + 1e-9)) as f32;
        Ok(ScreenRect {
            left: x[0] + w - slack,
            top: y[0] + h - slack,
            right: x[1] + w + slack,
            bottom: y[1] + h + slack,
            depth: depth.next_up(),
        })
    }
}

impl OcclusionBuffer {
    /// Asks about many boxes of world space: one verdict each, in their order, into `verdicts`.
    pub fn ask(&self, boxes: &Boxes, verdicts: &mut Vec<Verdict>) {
        let bands = [&self.band];
        self.frame.ask(&bands, boxes, verdicts);
    }

    /// Asks about one box of world space.
    pub fn ask_box(&self, bounds: &Aabb) -> Verdict {
        self.frame.ask_box(&[&self.band], bounds)
    }

    /// Asks about a ball. A radius or centre that is no finite number is never hidden.
    pub fn ask_sphere(&self, center: DVec3, radius: f64) -> Verdict {
        self.frame.ask_sphere(&[&self.band], center, radius)
    }

    /// Asks about many balls: one verdict each, in their order, into `verdicts`.
    pub fn ask_balls(&self, balls: &[Ball], verdicts: &mut Vec<Verdict>) {
        self.frame.ask_balls(&[&self.band], balls, verdicts);
    }

    /// Asks about a rectangle of the screen.
    pub fn ask_rect(&self, rect: &ScreenRect) -> Verdict {
        self.frame.ask_rect(&[&self.band], rect)
    }

    /// Asks about many rectangles of the screen: one verdict each, in their order, into `verdicts`.
    pub fn ask_rects(&self, rects: &[ScreenRect], verdicts: &mut Vec<Verdict>) {
        self.frame.ask_rects(&[&self.band], rects, verdicts);
    }

    /// Asks about another mesh: hidden if the boxes around its triangles are. Finer than a box around it.
    pub fn ask_mesh(&self, mesh: &Occludee, world_from_object: &DAffine3) -> Verdict {
        self.frame.ask_mesh(&[&self.band], mesh, world_from_object)
    }

    /// Asks about many meshes: one verdict each, in their order, into `verdicts`.
    pub fn ask_meshes(&self, meshes: &[PlacedMesh], verdicts: &mut Vec<Verdict>) {
        self.frame.ask_meshes(&[&self.band], meshes, verdicts);
    }
}

impl Frame {
    /// World space made ready for boxes.
    pub(in crate::cull) fn box_view(&self, screen_from_space: &ScreenFromObject) -> BoxView {
        let mut view = BoxView::new(screen_from_space, self.view.width, self.view.height);
        view.centres = self.meaning == Meaning::Sampled;
        if let Some(Margin { metres, pixels, depth }) = self.margin() {
            view.margin = [(metres as f32).next_up(), (pixels as f32).next_up()];
            view.depth_margin = (depth as f32).next_up();
            view.border = self.border as f32;
        }
        view
    }

    /// Whether boxes are to be widened by what objects may move.
    #[inline(always)]
    pub(in crate::cull) fn moves(&self) -> bool {
        self.options.objects_move > 0.0
    }

    /// How far boxes are widened, metres.
    fn widening(&self) -> f32 {
        let metres = self.options.objects_move * 2.0;
        (metres as f32).next_up() * f32::from(u8::from(metres > 0.0))
    }

    /// Boxes of a space widened by what objects may move.
    #[inline(always)]
    pub(in crate::cull) fn widened(
        &self,
        min: &[[f32; 16]; 3],
        max: &[[f32; 16]; 3],
        screen_from_space: &ScreenFromObject,
    ) -> ([[f32; 16]; 3], [[f32; 16]; 3]) {
        let metres = self.widening();
        if metres == 0.0 {
            return (*min, *max);
        }
        // The space may be a scaled one: how long its units are at least is seen from the screen's rows, which
        // an unscaled view would leave as long as they are.
        let shrunk = self.least_scale(screen_from_space);
        let boxes = SixteenBoxes { min: *min, max: *max }.widened((metres / shrunk).next_up());
        (boxes.min, boxes.max)
    }

    /// The least length in the world of a unit of a space.
    fn least_scale(&self, screen_from_space: &ScreenFromObject) -> f32 {
        let rows = |at: &ScreenFromObject| {
            let depth = if at.perspective { at.w } else { at.d };
            glam::DMat3::from_cols_array_2d(&[at.x, at.y, depth].map(|r| [r[0], r[1], r[2]])).transpose()
        };
        let (world, space) = (rows(&self.screen_from_world), rows(screen_from_space));
        let world_from_space = world.inverse() * space;
        // The inverse shrinks no more than its longest row's length says.
        let back = world_from_space.inverse();
        let largest = back.to_cols_array().iter().map(|c| c * c).sum::<f64>().sqrt();
        if largest.is_finite() && largest > 0.0 { (1.0 / largest) as f32 * 0.999 } else { f32::MIN_POSITIVE }
    }

    pub(super) fn ask(&self, bands: &[&Band], boxes: &Boxes, verdicts: &mut Vec<Verdict>) {
        verdicts.clear();
        verdicts.reserve(boxes.sixteen.len() * 16);
        dispatch!(self.options.level, simd => simd.vectorize(
            #[inline(always)]
            || self.ask_all(simd, bands, boxes, verdicts),
        ));
        verdicts.truncate(boxes.len);
    }

    #[inline(always)]
    fn ask_all<S: Simd>(&self, simd: S, bands: &[&Band], boxes: &Boxes, verdicts: &mut Vec<Verdict>) {
        let screen_from_boxes = boxes.screen_from_boxes(&self.screen_from_world);
        let (view, widening) = (self.box_view(&screen_from_boxes), self.widening());
        for sixteen in &boxes.sixteen {
            let on_screen = if widening > 0.0 {
                let wide = sixteen.widened(widening);
                project(simd, &view, &wide.min, &wide.max)
            } else {
                project(simd, &view, &sixteen.min, &sixteen.max)
            };
            let mut out = [Verdict::Outside; 16];
            let mut rest = on_screen.inside;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                out[lane] = verdict_of(simd, bands, &on_screen, lane, view.margin[0] > 0.0);
            }
            verdicts.extend(out);
        }
    }

    pub(super) fn ask_box(&self, bands: &[&Band], bounds: &Aabb) -> Verdict {
        let boxes = Boxes::from_iter([*bounds]);
        let mut verdicts = Vec::with_capacity(16);
        self.ask(bands, &boxes, &mut verdicts);
        verdicts[0]
    }

    pub(super) fn ask_balls(&self, bands: &[&Band], balls: &[Ball], verdicts: &mut Vec<Verdict>) {
        verdicts.clear();
        verdicts.extend(balls.iter().map(|ball| self.ask_sphere(bands, ball.center, ball.radius)));
    }

    pub(super) fn ask_rects(&self, bands: &[&Band], rects: &[ScreenRect], verdicts: &mut Vec<Verdict>) {
        verdicts.clear();
        verdicts.extend(rects.iter().map(|rect| self.ask_rect(bands, rect)));
    }

    pub(super) fn ask_meshes(&self, bands: &[&Band], meshes: &[PlacedMesh], verdicts: &mut Vec<Verdict>) {
        verdicts.clear();
        verdicts.extend(meshes.iter().map(|one| self.ask_mesh(bands, one.mesh, &one.world_from_object)));
    }

    pub(super) fn ask_sphere(&self, bands: &[&Band], center: DVec3, radius: f64) -> Verdict {
        let ball = Ball { center, radius: radius.abs() + self.options.objects_move * 2.0 };
        match ball.on_screen(&self.view, self.margin()) {
            Ok(rect) => self.judge_rect(bands, &rect),
            Err(verdict) => verdict,
        }
    }

    pub(super) fn ask_rect(&self, bands: &[&Band], rect: &ScreenRect) -> Verdict {
        match self.widened_rect(rect) {
            Some(rect) => self.judge_rect(bands, &rect),
            None => Verdict::Visible,
        }
    }

    /// The rectangle of an object that has moved as far as objects may, about all places where it can then be seen; `None`
    /// where it may come to the near plane.
    ///
    /// A point at (x, z) that moves by (a, b), m or less, comes to (x + a)/(z + b) in the image, (a − b·x/z)/(z + b) away:
    /// no more than m·√(1 + (x/z)²)/(z − m). `pixels_a_metre` holds the root for all x/z within the image; from beyond it,
    /// a rectangle reaches the border, where the answer is visible anyway.
    fn widened_rect(&self, rect: &ScreenRect) -> Option<ScreenRect> {
        // As boxes are: twice, for what hides it may have moved, too.
        let moves = self.options.objects_move * self.view.stretch() * 2.0;
        if moves == 0.0 || rect.depth.is_nan() {
            return Some(*rect);
        }
        let (nearest, depth) = match self.view.projection {
            Projection::Perspective { near, .. } => {
                let nearest = near / f64::from(rect.depth).max(0.0) * (1.0 - 1e-9) - moves;
                if nearest.is_nan() || nearest <= near {
                    return None;
                }
                (nearest, (near / nearest) as f32)
            }
            Projection::Orthographic { near, far, .. } => {
                (1.0, (f64::from(rect.depth) + moves / (far - near)) as f32)
            }
        };
        let by = moves * self.pixels_a_metre / nearest * (1.0 + 1e-9);
        let ScreenRect { left, top, right, bottom, .. } = *rect;
        Some(ScreenRect {
            left: left - by,
            top: top - by,
            right: right + by,
            bottom: bottom + by,
            depth: depth.next_up(),
        })
    }

    fn judge_rect(&self, bands: &[&Band], rect: &ScreenRect) -> Verdict {
        let ScreenRect { left, top, right, bottom, depth } = *rect;
        let (width, height) = (f64::from(self.view.width), f64::from(self.view.height));
        if !(left <= right && top <= bottom) || depth.is_nan() {
            return Verdict::Visible;
        }
        let margin = self.margin();
        if margin.is_some() && !(left > 0.0 && top > 0.0 && right < width && bottom < height) {
            return Verdict::Visible;
        }
        let beyond = is_beyond(&self.view, depth, margin.map_or(0.0, |margin| margin.depth));
        if right < 0.0 || bottom < 0.0 || left > width || top > height || beyond {
            return Verdict::Outside;
        }
        // What is drawn holds more than 0, and hides what lies beyond the far plane.
        let depth = depth.max(0.0);
        let pixel = |v: f64, size: f64| v.floor().clamp(0.0, size - 1.0) as i32;
        // A border that runs between two pixels touches both.
        let first = |v: f64, size: f64| pixel(v.ceil() - 1.0, size);
        let rect = [first(left, width), first(top, height), pixel(right, width), pixel(bottom, height)];
        let hidden = dispatch!(self.options.level, simd => bands.iter().all(|b| b.hides(simd, rect, depth)));
        if hidden { Verdict::Hidden } else { Verdict::Visible }
    }

    pub(super) fn ask_mesh(&self, bands: &[&Band], mesh: &Occludee, world_from_object: &DAffine3) -> Verdict {
        mesh.judge(world_from_object, |boxes, verdicts| self.ask(bands, boxes, verdicts))
    }
}

/// Whether a view sees nothing at this depth or beyond, where its far plane may come farther by as much as `margin`.
/// Without a far plane, it sees what is infinitely far away.
pub(super) fn is_beyond(view: &View, depth: f32, margin: f64) -> bool {
    match view.projection {
        Projection::Perspective { .. } => depth < 0.0,
        Projection::Orthographic { .. } => f64::from(depth) <= -margin,
    }
}

#[inline(always)]
fn verdict_of<S: Simd>(
    simd: S,
    bands: &[&Band],
    boxes: &BoxesOnScreen,
    lane: usize,
    moving: bool,
) -> Verdict {
    if moving && boxes.uncut >> lane & 1 == 0 {
        return Verdict::Visible;
    }
    let rect = [boxes.left[lane], boxes.top[lane], boxes.right[lane], boxes.bottom[lane]];
    for band in bands {
        if !band.hides(simd, rect, boxes.depth[lane]) {
            return Verdict::Visible;
        }
    }
    Verdict::Hidden
}

impl SixteenBoxes {
    /// Whether a lane's corners are in order and not too far away.
    pub fn is_box(&self, lane: usize) -> bool {
        (0..3).all(|axis| {
            let (low, high) = (self.min[axis][lane], self.max[axis][lane]);
            low <= high && low >= -1e15 && high <= 1e15
        })
    }

    fn widened(&self, by: f32) -> SixteenBoxes {
        SixteenBoxes {
            min: self.min.map(|axis| axis.map(|v| (v - by).next_down())),
            max: self.max.map(|axis| axis.map(|v| (v + by).next_up())),
        }
    }
}
