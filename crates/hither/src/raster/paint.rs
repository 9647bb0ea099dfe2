//! Writing a block's pixels: depths from a triangle's plane, and its surface; ties to the smaller id.
//!
//! A block's origin is evaluated in f64 from the plane and rounded once; pixels add `a·dx + b·dy` in f32 and are
//! clamped to the corners' range. These operations depend on the block's place in the image only, so every path
//! gives the same bits. The bound used to skip a block or tile is the plane's largest value there plus
//! `plane_margin`, clamped in the same way: a pixel's centre may lie beyond a corner, as far as snapping moves that, and
//! a steep plane is there below all that is written.

use super::pyramid::{MIXED, Sixteen, Target};
use super::setup::ScreenTriangle;
use crate::conventions::SurfaceId;
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, prelude::*, u32x16};

/// What a triangle's pixels get, and what may save work on the way.
#[derive(Clone, Copy)]
pub(super) struct How {
    pub id: SurfaceId,
    pub hierarchical: bool,
    pub masked: bool,
}

/// What a triangle's pixels get: depths, and a surface.
pub(super) struct Paint<S: Simd> {
    /// Depth plane over image pixels.
    pub plane: [f64; 3],
    /// From a block's first pixel to the others.
    pub depth_steps: f32x16<S>,
    /// The least of them.
    pub least_step: f32,
    /// Every depth is clamped to this range.
    pub depth_min: f32,
    pub depth_max: f32,
    pub slot: u32,
    pub how: How,
    pub wrote: bool,
}

impl<S: Simd> Paint<S> {
    #[inline(always)]
    pub fn new(simd: S, target: &Target, t: &ScreenTriangle, how: How) -> Paint<S> {
        let [a, b] = [t.plane[0] as f32, t.plane[1] as f32];
        let least = |slope: f32| if slope < 0.0 { 3.0 * slope } else { 0.0 };
        Paint {
            plane: t.plane,
            depth_steps: f32x16::from_slice(simd, &COLUMN_F) * a + f32x16::from_slice(simd, &ROW_F) * b,
            least_step: least(a) + least(b),
            depth_min: t.depth_min,
            depth_max: t.depth_max,
            slot: target.surfaces.len() as u32,
            how,
            wrote: false,
        }
    }

    /// Depths, or bounds on them, from values of the plane: at the corners' pixels a steep plane may reach beyond the
    /// corners themselves, on either side.
    #[inline(always)]
    pub fn clamped(&self, simd: S, plane: f32x16<S>) -> f32x16<S> {
        plane.max(f32x16::splat(simd, self.depth_min)).min(f32x16::splat(simd, self.depth_max))
    }

    /// Whether every pixel of an empty block that the triangle covers is written.
    #[inline(always)]
    pub fn can_cover(&self) -> bool {
        !self.how.masked && self.depth_min > 0.0
    }

    /// The plane at a window pixel, rounded once. Blocks pass their first pixel.
    ///
    /// The bits must not depend on the window: `plane` is shifted by whole multiples of 16 pixels, which
    /// is not exact in f64, so the shift happens here, on the integer.
    #[inline(always)]
    pub fn plane_at(&self, target: &Target, x: i32, y: i32) -> f32 {
        let (x, y) = (f64::from(x + target.left), f64::from(y + target.top));
        ((self.plane[0] * x + self.plane[1] * y) + self.plane[2]) as f32
    }

    /// More than any pixel's rounding error over a cell whose origin has plane value `origin`: at most
    /// four roundings of 2⁻²⁴ each of the origin and of steps up to `last` pixels.
    #[inline(always)]
    pub fn plane_margin(&self, origin: f32, last: f32) -> f32 {
        let slope = (self.plane[0].abs() + self.plane[1].abs()) as f32;
        (origin.abs() + slope * last) * (1.0 / (1 << 20) as f32)
    }

    /// [`Paint::plane_at`] for the first pixels of the sixteen blocks of the tile at window pixel (x, y): the
    /// same operations, so the same bits.
    #[inline(always)]
    pub fn plane_at_blocks(&self, simd: S, target: &Target, x: i32, y: i32) -> f32x16<S> {
        let (x, y) = (f64::from(x + target.left), f64::from(y + target.top));
        // Written out: closures are not always inlined into code for one instruction set.
        let columns = (f64x8::from_slice(simd, &BLOCK_COLUMN) + x) * self.plane[0];
        let upper = (f64x8::from_slice(simd, &BLOCK_ROW[0]) + y) * self.plane[1];
        let lower = (f64x8::from_slice(simd, &BLOCK_ROW[1]) + y) * self.plane[1];
        let halves = [(columns + upper) + self.plane[2], (columns + lower) + self.plane[2]];
        simd.narrow_f64x8(halves[0], halves[1])
    }

    /// [`Paint::plane_margin`] over blocks.
    #[inline(always)]
    pub fn plane_margins(&self, simd: S, origins: f32x16<S>) -> f32x16<S> {
        let slope = (self.plane[0].abs() + self.plane[1].abs()) as f32;
        (origins.abs() + f32x16::splat(simd, slope * 3.0)) * (1.0 / (1 << 20) as f32)
    }

    #[inline(always)]
    pub fn plane_rise(&self, last: f64) -> f32 {
        ((self.plane[0].max(0.0) + self.plane[1].max(0.0)) * last) as f32
    }
}

#[expect(clippy::too_many_arguments, reason = "the inner step of two loops, split off to be written once")]
/// Writes the pixels of block `block` of `tile`, which is touched, that are `covered` and nearer than what they
/// hold; `origin` is the plane at the block's first pixel, window pixel `corner`. Returns whether the block's
/// minimum rose: what lies above it in the pyramid is then to be marked stale.
#[inline(always)]
pub(super) fn fill_block<S: Simd>(
    simd: S,
    target: &mut Target,
    paint: &mut Paint<S>,
    tile: usize,
    block: usize,
    corner: (i32, i32),
    origin: f32,
    covered: u32,
    is_hole: &mut dyn FnMut(i32, i32) -> bool,
) -> bool {
    if target.visits.is_some() {
        target.count_polygon_visit(corner, 1, covered);
    }
    if covered == 0 {
        return false;
    }
    let at = tile * 16 + block;
    let z = paint.clamped(simd, paint.depth_steps + origin);
    let old = f32x16::from_slice(simd, &target.depth[at].0);
    let mut write = z.simd_gt(old).to_bitmask() as u32 & covered;
    let tied = z.simd_eq(old).to_bitmask() as u32 & covered;
    if tied != 0 {
        write |=
            win_ties(target, paint.how.id, at, tied, z.simd_gt(f32x16::splat(simd, 0.0)).to_bitmask() as u32);
    }
    if paint.how.masked {
        write = without_holes(write, (target.left + corner.0, target.top + corner.1), is_hole);
    }
    if write == 0 {
        return false;
    }
    paint.wrote = true;
    target.counters.pixels_written += u64::from(write.count_ones());
    if write == 0xFFFF {
        z.store_slice(&mut target.depth[at].0);
        target.block_id[at] = paint.slot;
        if !paint.how.hierarchical {
            return false;
        }
        // Rounding is monotonic, so the least pixel is the one with the least step.
        let min = (origin + paint.least_step).max(paint.depth_min).min(paint.depth_max);
        return target.raise_block_minimum(tile, block, min);
    }
    let mask = mask32x16::from_bitmask(simd, u64::from(write));
    let new = mask.select(z, old);
    new.store_slice(&mut target.depth[at].0);
    let slots = u32x16::splat(simd, paint.slot);
    let ids: &mut Sixteen<u32> = &mut target.id[at];
    let shared = std::mem::replace(&mut target.block_id[at], MIXED);
    let old_ids =
        if shared == MIXED { u32x16::from_slice(simd, &ids.0) } else { u32x16::splat(simd, shared) };
    mask.select(slots, old_ids).store_slice(&mut ids.0);
    if !paint.how.hierarchical {
        return false;
    }
    // As long as one of the farthest pixels stays, so does the minimum.
    let least = target.block_minima(tile)[block];
    if old.simd_eq(f32x16::splat(simd, least)).to_bitmask() as u32 & !write & 0xFFFF != 0 {
        return false;
    }
    target.raise_block_minimum(tile, block, new.reduce_min())
}

/// Of a block's pixels, those that are no holes; `corner` is its first image pixel.
#[inline(never)]
fn without_holes(pixels: u32, corner: (i32, i32), is_hole: &mut dyn FnMut(i32, i32) -> bool) -> u32 {
    (0..16)
        .filter(|p| pixels & (1 << p) != 0)
        .filter(|p| !is_hole(corner.0 + (p & 3), corner.1 + (p >> 2)))
        .fold(0, |kept, p| kept | 1 << p)
}

/// Of the pixels that hold exactly this depth, those whose surface has a larger id.
#[inline(never)]
pub(super) fn win_ties(target: &Target, id: SurfaceId, at: usize, tied: u32, drawn: u32) -> u32 {
    (0..16)
        .filter(|p| tied & drawn & (1 << p) != 0)
        .filter(|&p| id < target.surface_in(at, p))
        .fold(0, |won, p| won | 1 << p)
}

pub(super) const COLUMN: [i32; 16] = [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3];

pub(super) const ROW: [i32; 16] = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3];

pub(super) const BLOCK_COLUMN: [f64; 8] = [0., 4., 8., 12., 0., 4., 8., 12.];

pub(super) const BLOCK_ROW: [[f64; 8]; 2] =
    [[0., 0., 0., 0., 4., 4., 4., 4.], [8., 8., 8., 8., 12., 12., 12., 12.]];

pub(super) const COLUMN_F: [f32; 16] = [0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3.];

pub(super) const ROW_F: [f32; 16] = [0., 0., 0., 0., 1., 1., 1., 1., 2., 2., 2., 2., 3., 3., 3., 3.];
