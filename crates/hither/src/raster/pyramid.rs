//! A window's depth buffer in blocks, and the z-pyramid above it [Greene 1995, §3.3.2], kept lazily.
//!
//! Level 0 of the pyramid holds the farthest (smallest) depth of each 4×4-pixel block and is exact after
//! every write. Higher levels are refreshed when a test asks for them: a write that raises a block's
//! minimum marks the path to the root stale, stopping at the first ancestor already marked.
//!
//! A tile's pixels are initialised on first touch, so that clearing a window costs a sixteenth of its
//! pixels. Pixels beyond the image's right and bottom border hold +∞: nothing is drawn there, and they
//! never hold a minimum down.

use super::setup::Lanes;
use crate::conventions::SurfaceId;
use fearless_simd::{Simd, f32x16, prelude::*};

/// A half-open rectangle of pixels, in window coordinates unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// First column.
    pub left: i32,
    /// First row.
    pub top: i32,
    /// One past the last column.
    pub right: i32,
    /// One past the last row.
    pub bottom: i32,
}

/// What a window's tiling did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TargetCounters {
    /// Depth samples written, overwriting included.
    pub pixels_written: u64,
}

/// Sixteen children, one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Sixteen<T>(pub [T; 16]);

/// Minima of one level, grouped by parent.
#[derive(Debug, Default)]
pub(super) struct PyramidLevel {
    pub columns: usize,
    pub rows: usize,
    pub min: Vec<Sixteen<f32>>,
    /// Bit `c`: child `c`'s minimum is out of date (too far, hence still a bound).
    pub stale: Vec<u16>,
}

/// Per-pixel visit counts, for pictures of complexity.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visits {
    pub cubes: Vec<f32>,
    pub polygons: Vec<f32>,
}

/// A window of the image: depth, ids and z-pyramid.
#[derive(Debug)]
pub struct Target {
    /// First image column, a multiple of [`super::TILE`].
    pub left: i32,
    /// First image row, a multiple of [`super::TILE`].
    pub top: i32,
    /// Width, pixels.
    pub width: i32,
    /// Height, pixels.
    pub height: i32,
    /// What was done since the last [`Target::clear`].
    pub counters: TargetCounters,
    pub(super) tiles_x: usize,
    pub(super) depth: Vec<Sixteen<f32>>,
    /// Of each pixel; meaningless in a block that `block_id` speaks for.
    pub(super) id: Vec<Sixteen<u32>>,
    /// The id that all pixels of a block share, or [`MIXED`]: most blocks never need their sixteen.
    pub(super) block_id: Vec<u32>,
    pub(super) touched: Vec<bool>,
    pub(super) levels: Vec<PyramidLevel>,
    /// What the numbers in `id` stand for.
    pub(super) surfaces: Vec<SurfaceId>,
    pub(crate) visits: Option<Box<Visits>>,
    /// Room for the triangles being set up.
    pub(super) lanes: Option<Box<Lanes>>,
}

/// Gives a list a length, and memory that fits; whatever it holds.
fn fit<T: Copy>(list: &mut Vec<T>, length: usize, value: T) {
    if list.capacity() < length || list.capacity() / 4 > length {
        // A little more, for windows that grow a little.
        *list = Vec::with_capacity(length + length / 8);
    }
    list.resize(length, value);
}

impl Target {
    /// A window with its top left corner at image pixel (`left`, `top`), cleared.
    pub fn new(left: u32, top: u32, width: u32, height: u32) -> Target {
        let mut target = Target {
            left: 0,
            top: 0,
            width: 0,
            height: 0,
            counters: TargetCounters::default(),
            tiles_x: 0,
            depth: Vec::new(),
            id: Vec::new(),
            block_id: Vec::new(),
            touched: Vec::new(),
            levels: Vec::new(),
            surfaces: Vec::new(),
            visits: None,
            lanes: None,
        };
        target.reshape(left, top, width, height);
        target
    }

    /// Makes it a window like a new one, in the memory that it has if that is enough.
    pub fn reshape(&mut self, left: u32, top: u32, width: u32, height: u32) {
        assert!(
            left.is_multiple_of(super::TILE) && top.is_multiple_of(super::TILE),
            "windows start on tiles"
        );
        assert!(width > 0 && height > 0, "a window has pixels");
        (self.left, self.top, self.width, self.height) =
            (left as i32, top as i32, width as i32, height as i32);
        let (tiles_x, tiles_y) = (width.div_ceil(16) as usize, height.div_ceil(16) as usize);
        let blocks = tiles_x * tiles_y * 16;
        self.tiles_x = tiles_x;
        // What they hold is set when a tile is first touched.
        fit(&mut self.depth, blocks, Sixteen([0.0; 16]));
        fit(&mut self.id, blocks, Sixteen([0; 16]));
        fit(&mut self.block_id, blocks, MIXED);
        fit(&mut self.touched, tiles_x * tiles_y, false);
        let (mut columns, mut rows, mut depth) = (tiles_x, tiles_y, 0);
        loop {
            if self.levels.len() == depth {
                self.levels.push(PyramidLevel::default());
            }
            let level = &mut self.levels[depth];
            (level.columns, level.rows) = (columns, rows);
            fit(&mut level.min, columns * rows, Sixteen([0.0; 16]));
            fit(&mut level.stale, columns * rows, 0);
            depth += 1;
            if columns * rows == 1 {
                break;
            }
            (columns, rows) = (columns.div_ceil(4), rows.div_ceil(4));
        }
        self.levels.truncate(depth);
        self.clear();
    }

    /// Makes the window empty again.
    pub fn clear(&mut self) {
        self.counters = TargetCounters::default();
        self.surfaces.clear();
        self.touched.fill(false);
        let (mut children_x, mut children_y) =
            ((self.width as usize).div_ceil(4), (self.height as usize).div_ceil(4));
        for level in &mut self.levels {
            level.stale.fill(0);
            level.min.fill(Sixteen([0.0; 16]));
            // Children outside the window never hold their parent's minimum down.
            for parent_y in 0..level.rows {
                for parent_x in 0..level.columns {
                    let inside_x = children_x - parent_x * 4;
                    let inside_y = children_y - parent_y * 4;
                    if inside_x < 4 || inside_y < 4 {
                        let cell = &mut level.min[parent_y * level.columns + parent_x];
                        for c in 0..16 {
                            if c % 4 >= inside_x || c / 4 >= inside_y {
                                cell.0[c] = f32::INFINITY;
                            }
                        }
                    }
                }
            }
            (children_x, children_y) = (level.columns, level.rows);
        }
    }

    /// The whole window as a rectangle.
    pub fn bounds(&self) -> Rect {
        Rect { left: 0, top: 0, right: self.width, bottom: self.height }
    }

    /// Depth at a pixel of the window; 0 where nothing was drawn.
    pub fn depth_at(&self, x: u32, y: u32) -> f32 {
        let (block, pixel) = self.locate(x, y);
        if self.touched[block / 16] { self.depth[block].0[pixel] } else { 0.0 }
    }

    /// The surface at a pixel of the window.
    pub fn surface_at(&self, x: u32, y: u32) -> Option<SurfaceId> {
        let (block, pixel) = self.locate(x, y);
        let drawn = self.touched[block / 16] && self.depth[block].0[pixel] > 0.0;
        drawn.then(|| self.surface_in(block, pixel))
    }

    /// The surface at a pixel of a block, where one was drawn.
    #[inline(always)]
    pub(super) fn surface_in(&self, block: usize, pixel: usize) -> SurfaceId {
        let shared = self.block_id[block];
        let id = if shared == MIXED { self.id[block].0[pixel] } else { shared };
        self.surfaces[id as usize]
    }

    fn locate(&self, x: u32, y: u32) -> (usize, usize) {
        assert!((x as i32) < self.width && (y as i32) < self.height, "({x}, {y}) is outside the window");
        let tile = (y / 16) as usize * self.tiles_x + (x / 16) as usize;
        let block = tile * 16 + (y / 4 % 4 * 4 + x / 4 % 4) as usize;
        (block, (y % 4 * 4 + x % 4) as usize)
    }

    /// Brings the minima of `parent`'s stale children up to date.
    #[inline(always)]
    pub(super) fn refresh<S: Simd>(&mut self, simd: S, level: usize, parent: usize) {
        refresh_level(simd, &mut self.levels, level, parent);
    }

    /// Minima of a tile's sixteen blocks, exact.
    #[inline(always)]
    pub(super) fn block_minima(&self, tile: usize) -> &[f32; 16] {
        &self.levels[0].min[tile].0
    }

    /// Minima of sixteen tiles of a 64-pixel cell; `None` where the pyramid ends below.
    #[inline(always)]
    pub(super) fn tile_minima<S: Simd>(
        &mut self,
        simd: S,
        cell_x: usize,
        cell_y: usize,
    ) -> Option<&[f32; 16]> {
        if self.levels.len() < 2 {
            return None;
        }
        let parent = cell_y * self.levels[1].columns + cell_x;
        if self.levels[1].stale[parent] != 0 {
            self.refresh(simd, 1, parent);
        }
        Some(&self.levels[1].min[parent].0)
    }

    /// Records a block's minimum; returns whether it rose, and [`Target::mark_stale`] is due.
    #[inline(always)]
    pub(super) fn raise_block_minimum(&mut self, tile: usize, block: usize, min: f32) -> bool {
        let old = &mut self.levels[0].min[tile].0[block];
        let rises = min > *old;
        if rises {
            *old = min;
        }
        rises
    }

    /// What lies above a tile whose blocks' minima rose is out of date.
    #[inline(always)]
    pub(super) fn mark_stale(&mut self, tile: usize) {
        let (mut x, mut y) = (tile % self.tiles_x, tile / self.tiles_x);
        for level in &mut self.levels[1..] {
            let parent = (y >> 2) * level.columns + (x >> 2);
            let bit = 1u16 << ((y & 3) * 4 + (x & 3));
            if level.stale[parent] & bit != 0 {
                break;
            }
            level.stale[parent] |= bit;
            (x, y) = (x >> 2, y >> 2);
        }
    }

    /// Makes a tile's pixels readable; call before the first access in a frame.
    #[inline(always)]
    pub(super) fn touch(&mut self, tile: usize) {
        if !self.touched[tile] {
            self.initialise(tile);
        }
    }

    /// Whether nothing was drawn in a tile that lies wholly in the window.
    #[inline(always)]
    pub(super) fn is_fresh(&self, tile: usize) -> bool {
        let (x, y) = ((tile % self.tiles_x) as i32, (tile / self.tiles_x) as i32);
        !self.touched[tile] && x * 16 + 16 <= self.width && y * 16 + 16 <= self.height
    }

    #[inline(never)]
    fn initialise(&mut self, tile: usize) {
        self.touched[tile] = true;
        let blocks = &mut self.depth[tile * 16..tile * 16 + 16];
        blocks.fill(Sixteen([0.0; 16]));
        // What the pixels held in an earlier frame is of no use, and need not be fetched.
        self.block_id[tile * 16..tile * 16 + 16].fill(0);
        let x = (tile % self.tiles_x) as i32 * 16;
        let y = (tile / self.tiles_x) as i32 * 16;
        if x + 16 > self.width || y + 16 > self.height {
            for (b, block) in blocks.iter_mut().enumerate() {
                for (p, z) in block.0.iter_mut().enumerate() {
                    let px = x + (b % 4 * 4 + p % 4) as i32;
                    let py = y + (b / 4 * 4 + p / 4) as i32;
                    if px >= self.width || py >= self.height {
                        *z = f32::INFINITY;
                    }
                }
            }
        }
    }

    /// Takes over what another window of the same size shows where it is nearer; its instances' numbers grow by
    /// `first`. At equal depth this window's surface stays.
    pub(crate) fn merge(&mut self, other: &Target, first: u32) {
        assert!(self.width == other.width && self.height == other.height, "windows of different sizes");
        let slot = self.surfaces.len() as u32;
        let moved = |s: &SurfaceId| SurfaceId { instance: s.instance + first, ..*s };
        self.surfaces.extend(other.surfaces.iter().map(moved));
        for tile in (0..self.touched.len()).filter(|&tile| other.touched[tile]) {
            self.touch(tile);
            let mut rises = false;
            for block in tile * 16..tile * 16 + 16 {
                let (ours, theirs) = (&mut self.depth[block].0, &other.depth[block].0);
                if ours.iter().zip(theirs).all(|(ours, theirs)| ours >= theirs) {
                    continue;
                }
                let shared = std::mem::replace(&mut self.block_id[block], MIXED);
                if shared != MIXED {
                    self.id[block] = Sixteen([shared; 16]);
                }
                for p in 0..16 {
                    if ours[p] >= theirs[p] {
                        continue;
                    }
                    let shared = other.block_id[block];
                    let id = if shared == MIXED { other.id[block].0[p] } else { shared };
                    ours[p] = theirs[p];
                    self.id[block].0[p] = id + slot;
                }
                let least = self.depth[block].0.into_iter().fold(f32::INFINITY, f32::min);
                rises |= self.raise_block_minimum(tile, block % 16, least);
            }
            if rises {
                self.mark_stale(tile);
            }
        }
    }

    /// Starts or stops counting visits a pixel.
    pub(crate) fn record_visits(&mut self, on: bool) {
        let pixels = (self.width * self.height) as usize;
        self.visits = on.then(|| Box::new(Visits { cubes: vec![0.0; pixels], polygons: vec![0.0; pixels] }));
    }

    #[inline(always)]
    pub(super) fn count_cube_visit(&mut self, level: usize, parent: usize, mask: u32) {
        if let Some(visits) = &mut self.visits {
            let side = 4i32 << (2 * level);
            let columns = self.levels[level].columns;
            let corner = ((parent % columns) as i32 * side * 4, (parent / columns) as i32 * side * 4);
            add_visits(&mut visits.cubes, self.width, self.height, corner, side, mask);
        }
    }

    /// Counts a visit of sixteen children with side `side` whose parent's corner is `corner`.
    #[inline(always)]
    pub(super) fn count_polygon_visit(&mut self, corner: (i32, i32), side: i32, mask: u32) {
        if let Some(visits) = &mut self.visits {
            add_visits(&mut visits.polygons, self.width, self.height, corner, side, mask);
        }
    }
}

/// No id: a block's pixels have their own.
pub(super) const MIXED: u32 = u32::MAX;

/// Levels of the pyramid of the largest image: tiles of 16 pixels, then four times as much each.
pub(super) const MAX_LEVELS: usize = 8;

/// Brings stale minima up to date, from the leaves of the stale subtree upwards.
#[inline(always)]
fn refresh_level<S: Simd>(simd: S, levels: &mut [PyramidLevel], level: usize, parent: usize) {
    // Depth-first over stale cells; a cell is computed once its own children are fresh.
    let mut stack = [(0u8, 0u32); 16 * MAX_LEVELS];
    stack[0] = (level as u8, parent as u32);
    let mut open = 1;
    while open > 0 {
        let (level, parent) = (stack[open - 1].0 as usize, stack[open - 1].1 as usize);
        let stale = levels[level].stale[parent];
        if level == 0 || stale == 0 {
            open -= 1;
            continue;
        }
        let (px, py) = (parent % levels[level].columns, parent / levels[level].columns);
        let mut bits = stale;
        let mut waiting = 0u16;
        while bits != 0 {
            let c = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let child = (py * 4 + c / 4) * levels[level - 1].columns + px * 4 + c % 4;
            if level > 1 && levels[level - 1].stale[child] != 0 {
                waiting |= 1 << c;
                stack[open] = (level as u8 - 1, child as u32);
                open += 1;
                continue;
            }
            let values = f32x16::from_slice(simd, &levels[level - 1].min[child].0);
            levels[level].min[parent].0[c] = values.reduce_min();
        }
        levels[level].stale[parent] = waiting;
    }
}

/// Bits of the children x0..=x1, y0..=y1 of a 4×4 group (bit y·4 + x); none if a range is empty.
#[inline(always)]
pub(super) fn cell_mask(x0: i32, y0: i32, x1: i32, y1: i32) -> u32 {
    if x0 > x1 || y0 > y1 {
        return 0;
    }
    let columns = ((0xF << x0) & (0xF >> (3 - x1))) as u32 * 0x1111;
    let rows = (0xFFFFu32 << (4 * y0)) & (0xFFFF >> (4 * (3 - y1)));
    columns & rows
}

/// Adds 1/side² to every pixel of the children in `mask` [Greene 1995, §3.5.3].
#[inline(never)]
pub(super) fn add_visits(
    plane: &mut [f32],
    width: i32,
    height: i32,
    corner: (i32, i32),
    side: i32,
    mask: u32,
) {
    let share = 1.0 / (side * side) as f32;
    for c in (0..16).filter(|c| mask & (1 << c) != 0) {
        let (x0, y0) = (corner.0 + c % 4 * side, corner.1 + c / 4 * side);
        for y in y0..(y0 + side).min(height) {
            for x in x0..(x0 + side).min(width) {
                plane[(y * width + x) as usize] += share;
            }
        }
    }
}
