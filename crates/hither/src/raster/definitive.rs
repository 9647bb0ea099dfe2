//! The definitive test [Greene 1995, §3.3.2]: whether the pyramid hides a *box*, not the rectangle around it.
//!
//! On the screen a box is a convex polygon of at most six sides, which fills half of its rectangle or less where
//! it is seen along a diagonal. The test descends the pyramid as the rectangle test does, with sixteen cells at
//! a time against the polygon's sides.
//!
//! Greene compares with the depth of the box's own faces. That would not be a bound here: a triangle's depth at a
//! pixel centre that its snapped outline has just taken in lies on its plane *beyond* the triangle, and where it
//! is seen edge-on, in front of the faces of any box around it. What holds is the box's nearest depth, to which
//! every triangle is clamped.
//!
//! # The bound
//!
//! Corners are projected in f64. What is inside the box may be snapped 1/512 pixel beyond its outline, and f32
//! holds a side's value to 2⁻²² of 2¹⁶ pixels; sides are moved outwards by [`SLACK_PX`], twice the sum. A box that
//! reaches the near plane, or with corners far outside the window, is not decided here.

use super::paint::{COLUMN_F, ROW_F};
use super::pyramid::Rect;
use super::transform::ScreenFromObject;
use fearless_simd::{Simd, f32x16, prelude::*};

/// How far sides are moved outwards, pixels.
const SLACK_PX: f64 = 1.0 / 32.0;

/// Corners beyond this are left undecided, pixels.
const REACH_PX: f64 = 32_768.0;

/// A box on the screen, in window pixels: a point (x, y) is inside where `a·x + b·y + c ≥ 0` for all sides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    sides: [[f32; 3]; MOST_SIDES],
    used: usize,
}

/// The outline of a box seen from outside has four or six sides.
const MOST_SIDES: usize = 6;

/// Corners of a box on the screen, window pixels.
type Corners = [[f64; 2]; 8];

impl Outline {
    /// The outline of the box from `min` to `max` in the window at `window`; `None` where this test cannot
    /// decide.
    pub fn new(at: &ScreenFromObject, min: [f32; 3], max: [f32; 3], window: Rect) -> Option<Outline> {
        let corners = project(at, min, max, window)?;
        let mut outline = Outline { sides: [[0.0; 3]; MOST_SIDES], used: 0 };
        outline.add_sides(&corners)?;
        Some(outline)
    }

    /// The sides of the corners' convex hull (gift wrapping: eight points, six steps at most).
    fn add_sides(&mut self, corners: &Corners) -> Option<()> {
        let turn = |o: &[f64; 2], p: &[f64; 2], q: &[f64; 2]| {
            (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])
        };
        let first = (0..8).min_by(|&i, &j| {
            corners[i][0].total_cmp(&corners[j][0]).then(corners[i][1].total_cmp(&corners[j][1]))
        })?;
        let mut from = first;
        loop {
            let o = &corners[from];
            let distance = |p: &[f64; 2]| (p[0] - o[0]).abs() + (p[1] - o[1]).abs();
            let mut to = usize::from(from == 0);
            for next in 0..8 {
                let side = turn(o, &corners[to], &corners[next]);
                let farther = side == 0.0 && distance(&corners[next]) > distance(&corners[to]);
                if next != from && (side < 0.0 || farther) {
                    to = next;
                }
            }
            let p = &corners[to];
            // Inside lies to the left of the way from `o` to `p`.
            let (a, b) = (o[1] - p[1], p[0] - o[0]);
            let length = a.abs() + b.abs();
            if length < 1e-9 {
                // A box seen as a point or a line: the rectangle says as much.
                return None;
            }
            let (a, b) = (a / length, b / length);
            if self.used == MOST_SIDES {
                // Corners that nearly coincide; more sides than a box has.
                return None;
            }
            self.sides[self.used] = [a as f32, b as f32, (SLACK_PX - a * o[0] - b * o[1]) as f32];
            self.used += 1;
            from = to;
            if from == first {
                return Some(());
            }
        }
    }

    /// Which of 4×4 cells, of side `side` pixels and the first with its first pixel at (`x`, `y`), meet the
    /// polygon.
    #[inline(always)]
    pub fn cells<S: Simd>(&self, simd: S, x: f32, y: f32, side: i32) -> u32 {
        let x = f32x16::from_slice(simd, &COLUMN_F) * side as f32 + x;
        let y = f32x16::from_slice(simd, &ROW_F) * side as f32 + y;
        let zero = f32x16::splat(simd, 0.0);
        let last = (side - 1) as f32;
        let mut inside = 0xFFFFu64;
        for [a, b, c] in &self.sides[..self.used] {
            let most = c + (a.max(0.0) + b.max(0.0)) * last;
            inside &= (x * *a + y * *b + most).simd_ge(zero).to_bitmask();
        }
        inside as u32
    }
}

/// Corners in window pixels relative to pixel centres, so that pixel (x, y) is the point (x, y); `None` where
/// one lies before the near plane or too far outside.
fn project(at: &ScreenFromObject, min: [f32; 3], max: [f32; 3], window: Rect) -> Option<Corners> {
    let mut corners = [[0.0; 2]; 8];
    let [lost_x, lost_y, lost_w] = at.lost();
    let lost_px = (lost_x.max(lost_y) / 256.0 + REACH_PX * lost_w) * 4.0;
    for (i, corner) in corners.iter_mut().enumerate() {
        let p = [0, 1, 2].map(|k| f64::from(if i >> k & 1 == 0 { min[k] } else { max[k] }));
        let [x, y, w, d] = at.point(p);
        // Nor what f64 has lost too much of.
        if !(d <= w && w > 0.0 && lost_px < w * SLACK_PX * 0.5) {
            return None;
        }
        *corner = [x / w / 256.0 - 0.5 - f64::from(window.left), y / w / 256.0 - 0.5 - f64::from(window.top)];
        if !(corner[0].abs() < REACH_PX && corner[1].abs() < REACH_PX) {
            return None;
        }
    }
    Some(corners)
}
