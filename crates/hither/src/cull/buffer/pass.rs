//! Drawing a patch for all eyes of a margin: how far it is eroded, and where it is cut so that its far parts lose less.
//!
//! What an eye's displacement moves on the image falls with the distance. So a patch that reaches from near to far is
//! drawn several times: as it is, or what lies beyond the least distance at which it can count; then what lies beyond
//! four times that, and so on. Each is a surface of its own, cut by a plane across the view.
//!
//! *Eroded by slack.* Where a corner may be off by δ, a square is covered if that which is δ wider each way is, and its
//! depth is the least within that. So eroding by ρ is drawing with a slack of δ + ρ, which all ways to draw a patch know,
//! as long as their numbers have room for it ([`MOST_SLACK`]). What moves more is counted first and then eroded by blocks of
//! 4×4 pixels.

use super::Margin;
use super::draw::{DEPTH_IS_LESS, Open, Standing};
use super::occluder::Patch;
use super::place::Placing;

/// The largest erosion that slack may stand for, 1/256 pixel: with the largest slack that corners have, edge functions
/// of 2²⁴ by that, over 2⁸, are below 2³⁰.
const MOST_SLACK: f64 = 24.0 * 256.0;

/// Patches that would lose more pixels than this are not drawn.
const MOST_MARGIN_PX: f64 = 256.0;

/// A patch is drawn again beyond so many times the distance.
const FARTHER: f64 = 4.0;

/// As long as it loses more pixels there than this.
const PX_WORTH_A_PASS: f64 = 2.0;

/// Pixels of the rectangle around a patch, at least, for each of its faces if it is drawn more than once.
const PX_A_FACE_OF_A_PASS: i64 = 64;

/// One of the ways in which a patch is drawn.
#[derive(Clone, Copy)]
pub(super) struct Pass {
    pub open: Open,
    /// With the erosion in its slack, or to be eroded jointly.
    pub placing: Placing,
    pub jointly: bool,
    /// No point of what is drawn is nearer, along the view; 1 in an orthographic view.
    distance: f64,
}

impl Standing<'_> {
    /// How far a patch is to be eroded, 1/256 pixel, of which no point is nearer than `depth`; `None` if slack cannot stand
    /// for it, or some of it may be nearer than what counts.
    #[inline(always)]
    pub fn erosion(&self, depth: f32) -> Option<i32> {
        let Some(margin) = self.margin else { return Some(0) };
        let depth = f64::from(depth);
        if !self.at.perspective {
            return if depth + DEPTH_IS_LESS + margin.depth > 1.0 { None } else { slack_for(&margin, 1.0) };
        }
        self.erosion_from(self.at.d[3] / depth)
    }

    /// The same in a perspective view, given a distance.
    #[inline(always)]
    pub fn erosion_from(&self, distance: f64) -> Option<i32> {
        let Some(margin) = self.margin else { return Some(0) };
        if distance < self.least_distance(&margin) { None } else { slack_for(&margin, distance) }
    }

    /// What is nearer does not count: it may have the near plane of an eye that comes behind it, or move too far.
    #[inline(always)]
    fn least_distance(&self, margin: &Margin) -> f64 {
        let least = (self.at.d[3] + margin.metres).max(margin.metres * margin.pixels / MOST_MARGIN_PX);
        // More than the roundings of where a cut lies, and of a depth in f32.
        least * 1.000_1
    }
}

/// Slack for what a margin moves at a distance; `None` if there is no room for it.
#[inline(always)]
fn slack_for(margin: &Margin, distance: f64) -> Option<i32> {
    let slack = (margin.metres * margin.pixels / distance * 256.0 * 1.000_01).ceil();
    (slack <= MOST_SLACK).then_some(slack as i32)
}

impl Pass {
    /// The first. `None` where f64 could not tell where on the screen its corners are.
    #[inline(always)]
    pub fn first(standing: &Standing, open: Open) -> Option<Pass> {
        let near = standing.at.d[3];
        // depth ≥ near / W for all of the patch.
        let distance = match standing.at.perspective {
            true if open.clear => near / f64::from(open.depth),
            true => near,
            false => 1.0,
        };
        let Some(margin) = standing.margin else {
            let placing = Placing::new(&standing.at, &standing.sizes, distance)?;
            return Some(Pass { open, placing, jointly: false, distance });
        };
        Pass::eroded(standing, open, &margin, distance)
    }

    #[inline(never)]
    fn eroded(standing: &Standing, open: Open, margin: &Margin, distance: f64) -> Option<Pass> {
        if !standing.at.perspective {
            let mut placing = Placing::new(&standing.at, &standing.sizes, distance)?;
            let erosion = if open.clear { standing.erosion(open.depth) } else { None };
            placing.slack += erosion.unwrap_or(0);
            return Some(Pass { open, placing, jointly: erosion.is_none(), distance });
        }
        let least = standing.least_distance(margin);
        if distance < least {
            return Pass::beyond(standing, open, margin, least);
        }
        let mut placing = Placing::new(&standing.at, &standing.sizes, distance)?;
        let erosion = slack_for(margin, distance);
        placing.slack += erosion.unwrap_or(0);
        Some(Pass { open, placing, jointly: erosion.is_none(), distance })
    }

    /// What lies beyond a distance.
    fn beyond(standing: &Standing, open: Open, margin: &Margin, distance: f64) -> Option<Pass> {
        let near = standing.at.d[3];
        let mut at = standing.at;
        at.d[3] = distance;
        let mut placing = Placing::new(&at, &standing.sizes, distance)?;
        // Depths are those of the view, not of one that begins there.
        placing.shrink *= near / distance * (1.0 - 1e-15);
        let distance = standing.sizes.least_w(distance);
        if distance < near + margin.metres {
            return None;
        }
        let erosion = slack_for(margin, distance);
        placing.slack += erosion.unwrap_or(0);
        Some(Pass { open: Open { clear: false, ..open }, placing, jointly: erosion.is_none(), distance })
    }

    /// Pixels to erode what is drawn jointly by; `None` if some of it is too near to the near plane, or they are too many.
    /// `nearest` is the largest depth of what is drawn.
    pub fn margin_px(&self, standing: &Standing, nearest: f32) -> Option<i32> {
        let margin = standing.margin?;
        let too_near =
            !standing.at.perspective && f64::from(nearest) * 1.000_001 + DEPTH_IS_LESS + margin.depth > 1.0;
        let px = (margin.metres * margin.pixels / self.distance * 1.000_01).ceil();
        (!too_near && px <= MOST_MARGIN_PX).then_some(px as i32)
    }

    /// The next, if it is worth its while.
    #[inline(always)]
    pub fn after(&self, standing: &Standing, patch: &Patch) -> Option<Pass> {
        let margin = standing.margin.filter(|_| standing.at.perspective)?;
        self.next(standing, patch, &margin)
    }

    #[inline(never)]
    fn next(&self, standing: &Standing, patch: &Patch, margin: &Margin) -> Option<Pass> {
        let distance = self.distance * FARTHER;
        let [left, top, right, bottom] = self.open.rect;
        let pixels = i64::from(right - left + 1) * i64::from(bottom - top + 1);
        let reaches = f64::from(self.open.farthest) * distance < standing.at.d[3];
        let worth = margin.metres * margin.pixels / self.distance > PX_WORTH_A_PASS;
        let few_faces = i64::from(patch.faces) * PX_A_FACE_OF_A_PASS <= pixels;
        if !(reaches && worth && few_faces) {
            return None;
        }
        Pass::beyond(standing, self.open, margin, distance)
    }
}

/// Least values over windows of 2·radius + 1 elements, each `width` wide; beyond both ends is 0.
#[inline(always)]
pub(super) fn erode(values: &mut Vec<f32>, width: usize, radius: usize) {
    let padding = vec![0.0; radius * width];
    let count = values.len();
    let mut wide = [&padding, values.as_slice(), &padding].concat();
    // Windows of a power of two, doubled until two of them span the whole.
    let mut length = 1;
    while length * 2 <= 2 * radius + 1 {
        for i in 0..wide.len() - length * width {
            wide[i] = wide[i].min(wide[i + length * width]);
        }
        length *= 2;
    }
    let shift = (2 * radius + 1 - length) * width;
    values.clear();
    values.extend((0..count).map(|i| wide[i].min(wide[i + shift])));
}
