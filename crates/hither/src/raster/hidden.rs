//! Asking the pyramid: is a rectangle, or the outline of a box, hidden at a depth?
//!
//! The answers are exact for the pixels asked about: "hidden" means that every one of them holds something nearer.

use super::definitive::Outline;
use super::pyramid::{MAX_LEVELS, Rect, Target, add_visits, cell_mask};
use super::transform::ScreenFromObject;
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

impl Target {
    /// Whether nothing at or behind `depth` could be seen anywhere in `rect`: Greene's fast
    /// bounding-rectangle test. Exact for the rectangle: `false` means that at least one of its pixels
    /// holds `depth` or something farther.
    ///
    /// `rect` is clipped to the window; an empty one is hidden. Cost: a few cells along its border.
    pub fn is_hidden(&mut self, level: Level, rect: Rect, depth: f32) -> bool {
        dispatch!(level, simd => self.hides(simd, rect, depth))
    }

    #[inline(always)]
    pub(crate) fn hides<S: Simd>(&mut self, simd: S, rect: Rect, depth: f32) -> bool {
        let left = rect.left.max(0);
        let top = rect.top.max(0);
        let right = rect.right.min(self.width) - 1;
        let bottom = rect.bottom.min(self.height) - 1;
        if left > right || top > bottom {
            return true;
        }
        let rect = [left, top, right, bottom];
        // What is far away is this small: it asks the pixels themselves.
        if right - left < 2 && bottom - top < 2 && self.visits.is_none() {
            return !self.shows_in_pixels(rect, depth);
        }
        if (right >> 2) - (left >> 2) < 2 && (bottom >> 2) - (top >> 2) < 2 {
            return !self.shows_in_blocks(simd, rect, depth);
        }
        // Finest level at which the rectangle meets at most 2×2 parents: parents at level k have side
        // 4^(k+2), and an extent below 4^(k+2) touches at most two of them.
        let extent = (right - left).max(bottom - top) as u32;
        let log4 = (31 - (extent | 15).leading_zeros()) / 2;
        let level = (log4 as usize - 1).min(self.levels.len() - 1);
        let parents = self.look_at_parents(simd, level, rect, depth);
        if parents.shown {
            return false;
        }
        let shift = 2 * (level as u32 + 2);
        for (i, &open) in (0i32..).zip(&parents.open) {
            let (px, py) = ((left >> shift) + (i & 1), (top >> shift) + (i >> 1));
            let mut rest = open;
            while rest != 0 {
                let c = rest.trailing_zeros() as i32;
                rest &= rest - 1;
                let (x, y) = (px * 4 + (c & 3), py * 4 + (c >> 2));
                let shows = if level == 0 {
                    let tile = py as usize * self.tiles_x + px as usize;
                    self.pixels_at_or_behind(simd, tile, c as usize, x, y, rect, depth) != 0
                } else {
                    self.shows_in(simd, level - 1, x as usize, y as usize, rect, depth)
                };
                if shows {
                    return false;
                }
            }
        }
        true
    }

    /// Whether some pixel of `[left, top, right, bottom]` (inclusive), at most 2×2, holds `depth` or something
    /// farther.
    #[inline(always)]
    fn shows_in_pixels(&self, rect: [i32; 4], depth: f32) -> bool {
        let [left, top, right, bottom] = rect;
        let mut shown = false;
        // Where there are fewer than four, one comes again: that costs less than to find out.
        for (x, y) in [(left, top), (right, top), (left, bottom), (right, bottom)] {
            let tile = (y >> 4) as usize * self.tiles_x + (x >> 4) as usize;
            let block = tile * 16 + ((y & 12) + (x >> 2 & 3)) as usize;
            let pixel = ((y & 3) * 4 + (x & 3)) as usize;
            shown |= !self.touched[tile] | (self.depth[block].0[pixel] <= depth);
        }
        shown
    }

    /// Whether some pixel of `[left, top, right, bottom]` (inclusive), which meets at most 2×2 blocks, holds
    /// `depth` or something farther. Without a branch: which blocks there are cannot be foreseen.
    #[inline(always)]
    fn shows_in_blocks<S: Simd>(&mut self, simd: S, rect: [i32; 4], depth: f32) -> bool {
        let [left, top, right, bottom] = rect;
        let (bx, by) = ([left >> 2, right >> 2], [top >> 2, bottom >> 2]);
        let columns = span(left - bx[0] * 4, right + 1 - bx[0] * 4);
        let rows = span(top - by[0] * 4, bottom + 1 - by[0] * 4);
        if self.visits.is_some() {
            self.count_visits_of_blocks(bx, by, columns, rows);
        }
        let depth = f32x16::splat(simd, depth);
        let mut shown = 0;
        for i in 0..4 {
            // Where there are fewer than four, one comes again, and none of its pixels is asked.
            let (x, y) = (bx[i & 1], by[i >> 1]);
            let pixels = sixteen(columns >> (4 * (i & 1)), rows >> (4 * (i >> 1)));
            let tile = (y >> 2) as usize * self.tiles_x + (x >> 2) as usize;
            let untouched = if self.touched[tile] { 0 } else { 0xFFFF };
            let block = tile * 16 + ((y & 3) * 4 + (x & 3)) as usize;
            let values = f32x16::from_slice(simd, &self.depth[block].0);
            shown |= (values.simd_le(depth).to_bitmask() as u32 | untouched) & pixels;
        }
        shown != 0
    }

    /// Counts a visit of the pixels in these columns and rows of 2×2 blocks.
    #[inline(never)]
    fn count_visits_of_blocks(&mut self, bx: [i32; 2], by: [i32; 2], columns: u32, rows: u32) {
        let Some(visits) = &mut self.visits else { return };
        for i in 0..4 {
            let corner = (bx[i & 1] * 4, by[i >> 1] * 4);
            let pixels = sixteen(columns >> (4 * (i & 1)), rows >> (4 * (i >> 1)));
            add_visits(&mut visits.cubes, self.width, self.height, corner, 1, pixels);
        }
    }

    /// What the children of the at most 2×2 parents at `level` that a rectangle meets say of it at a depth.
    #[inline(always)]
    fn look_at_parents<S: Simd>(&mut self, simd: S, level: usize, rect: [i32; 4], depth: f32) -> Parents {
        let shift = 2 * (level as u32 + 1);
        let up = (1i32 << shift) - 1;
        let [left, top, right, bottom] = rect;
        let px = [left >> (shift + 2), right >> (shift + 2)];
        let py = [top >> (shift + 2), bottom >> (shift + 2)];
        let (x, y) = (px[0] * 4, py[0] * 4);
        let columns = span((left >> shift) - x, (right >> shift) + 1 - x);
        let rows = span((top >> shift) - y, (bottom >> shift) + 1 - y);
        let whole_columns = span(((left + up) >> shift) - x, ((right + 1) >> shift) - x);
        let whole_rows = span(((top + up) >> shift) - y, ((bottom + 1) >> shift) - y);
        let depth = f32x16::splat(simd, depth);
        let mut parents = Parents { open: [0; 4], shown: false };
        for i in 0..4 {
            // Where there are fewer than four, one comes again, and none of its children is asked.
            let parent = py[i >> 1] as usize * self.levels[level].columns + px[i & 1] as usize;
            if level > 0 && self.levels[level].stale[parent] != 0 {
                self.refresh(simd, level, parent);
            }
            let (right, down) = (4 * (i & 1), 4 * (i >> 1));
            let meets = sixteen(columns >> right, rows >> down);
            if self.visits.is_some() {
                self.count_cube_visit(level, parent, meets);
            }
            let values = f32x16::from_slice(simd, &self.levels[level].min[parent].0);
            parents.open[i] = values.simd_le(depth).to_bitmask() as u32 & meets;
            parents.shown |= parents.open[i] & sixteen(whole_columns >> right, whole_rows >> down) != 0;
        }
        parents
    }

    /// A first, cheap look: whether the one pyramid sample around `[left, top, right, bottom]` (inclusive, in
    /// the window) hides `depth` — step 2 of [Greene 1995, fig. 3.5]. Stale samples are too far, so still
    /// a bound.
    #[inline(always)]
    pub(crate) fn one_sample_hides(&self, rect: [u16; 4], depth: f32) -> bool {
        let [left, top, right, bottom] = rect;
        let differ = u32::from((left ^ right) | (top ^ bottom));
        // Finest cells of side 4^(k+1) that hold both corners.
        let level = ((31 - (differ | 1).leading_zeros()) / 2) as usize;
        let Some(samples) = self.levels.get(level) else { return false };
        let shift = 2 * (level + 1);
        let (x, y) = ((left >> shift) as usize, (top >> shift) as usize);
        samples.min[(y >> 2) * samples.columns + (x >> 2)].0[(y & 3) * 4 + (x & 3)] > depth
    }

    /// Whether nothing at or behind `depth` could be seen anywhere in the outline of the box from `min` to
    /// `max`, of whose rectangle `rect` [`Target::hides`] said no: the definitive test (see `definitive`).
    #[inline(always)]
    pub(crate) fn hides_outline<S: Simd>(
        &mut self,
        simd: S,
        at: &ScreenFromObject,
        bounds: [[f32; 3]; 2],
        rect: Rect,
        depth: f32,
    ) -> bool {
        let window = Rect {
            left: self.left,
            top: self.top,
            right: self.left + self.width,
            bottom: self.top + self.height,
        };
        let Some(outline) = Outline::new(at, bounds[0], bounds[1], window) else { return false };
        let rect = [rect.left, rect.top, rect.right - 1, rect.bottom - 1];
        let top = self.levels.len() - 1;
        // Depth first, as `shows_in`, with the polygon's sides as a further sieve.
        let mut stack = [(0u32, 0u32, 0u32); MAX_LEVELS + 1];
        let mut level = top;
        let (mut px, mut py) = (0u32, 0u32);
        let mut bits = self.open_in_outline(simd, level, px, py, rect, depth, &outline);
        loop {
            if bits == 0 {
                if level == top {
                    return true;
                }
                level += 1;
                (px, py, bits) = stack[level];
                continue;
            }
            let c = bits.trailing_zeros();
            bits &= bits - 1;
            let (cx, cy) = (px * 4 + c % 4, py * 4 + c / 4);
            if level > 0 {
                let inner = self.open_in_outline(simd, level - 1, cx, cy, rect, depth, &outline);
                if inner != 0 {
                    stack[level] = (px, py, bits);
                    level -= 1;
                    (px, py, bits) = (cx, cy, inner);
                }
                continue;
            }
            let tile = py as usize * self.levels[0].columns + px as usize;
            let pixels = self.pixels_at_or_behind(simd, tile, c as usize, cx as i32, cy as i32, rect, depth);
            if pixels & outline.cells(simd, (cx * 4) as f32, (cy * 4) as f32, 1) != 0 {
                return false;
            }
        }
    }

    /// The children of a parent that meet `rect` and the outline, and hold `depth` or something farther.
    #[expect(clippy::too_many_arguments, reason = "the inner step of one search, split off to be read")]
    #[inline(always)]
    fn open_in_outline<S: Simd>(
        &mut self,
        simd: S,
        level: usize,
        px: u32,
        py: u32,
        rect: [i32; 4],
        depth: f32,
        outline: &Outline,
    ) -> u32 {
        let bits = self.children_at_or_behind(simd, level, px, py, rect, depth);
        if bits == 0 {
            return 0;
        }
        let side = 4i32 << (2 * level);
        bits & outline.cells(simd, (px as i32 * side * 4) as f32, (py as i32 * side * 4) as f32, side)
    }

    /// Whether some pixel of `[left, top, right, bottom]` (inclusive) inside this parent cell holds
    /// `depth` or something farther.
    #[inline(always)]
    fn shows_in<S: Simd>(
        &mut self,
        simd: S,
        top_level: usize,
        parent_x: usize,
        parent_y: usize,
        rect: [i32; 4],
        depth: f32,
    ) -> bool {
        // Depth first: for each level above the present one, the parent and its children still to visit.
        let mut above = [(0u32, 0u32, 0u32); MAX_LEVELS];
        let mut level = top_level;
        let (mut px, mut py) = (parent_x as u32, parent_y as u32);
        let mut bits = match self.open_children(simd, level, px, py, rect, depth) {
            Children::Shown => return true,
            Children::Open(bits) => bits,
        };
        loop {
            if bits == 0 {
                if level == top_level {
                    return false;
                }
                level += 1;
                (px, py, bits) = above[level];
                continue;
            }
            let c = bits.trailing_zeros();
            bits &= bits - 1;
            let (cx, cy) = (px * 4 + c % 4, py * 4 + c / 4);
            if level == 0 {
                let tile = py as usize * self.levels[0].columns + px as usize;
                if self.pixels_at_or_behind(simd, tile, c as usize, cx as i32, cy as i32, rect, depth) != 0 {
                    return true;
                }
                continue;
            }
            let inner = match self.open_children(simd, level - 1, cx, cy, rect, depth) {
                Children::Shown => return true,
                Children::Open(inner) => inner,
            };
            if inner != 0 {
                above[level] = (px, py, bits);
                level -= 1;
                (px, py, bits) = (cx, cy, inner);
            }
        }
    }

    /// Which of a parent's children meet `rect` and hold `depth` or something farther.
    #[inline(always)]
    fn children_at_or_behind<S: Simd>(
        &mut self,
        simd: S,
        level: usize,
        px: u32,
        py: u32,
        rect: [i32; 4],
        depth: f32,
    ) -> u32 {
        let parent = py as usize * self.levels[level].columns + px as usize;
        if level > 0 && self.levels[level].stale[parent] != 0 {
            self.refresh(simd, level, parent);
        }
        let shift = 2 * (level as u32 + 1);
        let (base_x, base_y) = ((px as i32) << 2, (py as i32) << 2);
        let meets = cell_mask(
            ((rect[0] >> shift) - base_x).max(0),
            ((rect[1] >> shift) - base_y).max(0),
            ((rect[2] >> shift) - base_x).min(3),
            ((rect[3] >> shift) - base_y).min(3),
        );
        if self.visits.is_some() {
            self.count_cube_visit(level, parent, meets);
        }
        let values = f32x16::from_slice(simd, &self.levels[level].min[parent].0);
        values.simd_le(f32x16::splat(simd, depth)).to_bitmask() as u32 & meets
    }

    /// The same; or that one of them lies wholly inside `rect`, whose minimum is then a pixel of it.
    #[inline(always)]
    fn open_children<S: Simd>(
        &mut self,
        simd: S,
        level: usize,
        px: u32,
        py: u32,
        rect: [i32; 4],
        depth: f32,
    ) -> Children {
        let bits = self.children_at_or_behind(simd, level, px, py, rect, depth);
        if bits == 0 {
            return Children::Open(0);
        }
        let shift = 2 * (level as u32 + 1);
        let (base_x, base_y) = ((px as i32) << 2, (py as i32) << 2);
        let up = (1i32 << shift) - 1;
        let whole = cell_mask(
            (((rect[0] + up) >> shift) - base_x).max(0),
            (((rect[1] + up) >> shift) - base_y).max(0),
            (((rect[2] + 1) >> shift) - base_x - 1).min(3),
            (((rect[3] + 1) >> shift) - base_y - 1).min(3),
        );
        if bits & whole != 0 { Children::Shown } else { Children::Open(bits) }
    }

    /// Which of a block's pixels lie in `rect` and hold `depth` or something farther.
    #[expect(clippy::too_many_arguments, reason = "the last step of two searches")]
    #[inline(always)]
    fn pixels_at_or_behind<S: Simd>(
        &mut self,
        simd: S,
        tile: usize,
        block: usize,
        bx: i32,
        by: i32,
        rect: [i32; 4],
        depth: f32,
    ) -> u32 {
        let x0 = (rect[0] - bx * 4).max(0);
        let y0 = (rect[1] - by * 4).max(0);
        let x1 = (rect[2] - bx * 4).min(3);
        let y1 = (rect[3] - by * 4).min(3);
        let mask = cell_mask(x0, y0, x1, y1);
        if !self.touched[tile] {
            return mask;
        }
        let values = f32x16::from_slice(simd, &self.depth[tile * 16 + block].0);
        if let Some(visits) = &mut self.visits {
            add_visits(&mut visits.cubes, self.width, self.height, (bx * 4, by * 4), 1, mask);
        }
        values.simd_le(f32x16::splat(simd, depth)).to_bitmask() as u32 & mask
    }
}

/// What the children of up to 2×2 parents say of a rectangle at a depth.
struct Parents {
    /// Of each parent, the children that meet the rectangle and hold the depth or something farther.
    open: [u32; 4],
    /// Whether one of them lies wholly inside the rectangle: its minimum is a pixel of it.
    shown: bool,
}

/// Bits `from..to`, none where that is empty.
#[inline(always)]
fn span(from: i32, to: i32) -> u32 {
    (1u32 << to.max(from)) - (1 << from)
}

/// Bits of the children of a 4×4 group in these of its columns and rows: the lowest four bits of each.
#[inline(always)]
fn sixteen(columns: u32, rows: u32) -> u32 {
    const ROWS: [u32; 16] = [
        0x0000, 0x000F, 0x00F0, 0x00FF, 0x0F00, 0x0F0F, 0x0FF0, 0x0FFF, 0xF000, 0xF00F, 0xF0F0, 0xF0FF,
        0xFF00, 0xFF0F, 0xFFF0, 0xFFFF,
    ];
    ((columns & 15) * 0x1111) & ROWS[rows as usize & 15]
}

/// What a parent's children say of a rectangle at a depth.
enum Children {
    /// It shows in one of them.
    Shown,
    /// It may show in these.
    Open(u32),
}

#[cfg(test)]
mod tests;
