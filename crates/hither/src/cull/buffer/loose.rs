//! Loose faces, each a patch by itself: sixteen at a time, straight into the surface.
//!
//! The surface ends at every edge of such a face, so that a pixel is covered where its square, widened by the
//! slack, lies inside all edges, and nothing need be counted. In a row of pixels these are the ones from the
//! rightmost of the left edges' bounds to the leftmost of the right ones':
//!
//! ```text
//! edge from p, rising m = dx/dy columns a row:   x(y) = p.x + m·(y − p.y) ± (½ + slack)·(1 + |m|)
//! ```
//!
//! Level edges bound the rows. A face that touches no more than two columns or rows covers no pixel, and goes
//! no further than its corners.
//!
//! *Bound.* Bounds are taken in f32. p, y and their difference have at most 24 bits and are exact; each of the
//! six roundings is at most 2⁻²⁴ of the terms' magnitudes. Each bound is moved inwards by 2⁻²⁰ of them.

use super::draw::Standing;
use super::occluder::{Face, Patch, Vertices};
use super::place::{Placing, ROUND, dot};
use super::surface::Surface;
use super::tile::{COLUMNS, tile_plane};
use crate::index::Box3;
use crate::raster::{GUARD_MAX, GUARD_MIN, ScreenFromObject};
use fearless_simd::{Simd, f32x16, f64x8, i32x16, mask32x16, prelude::*};

/// At most sixteen loose faces that lie together.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct LooseFaces {
    /// `corner[k][axis][lane]`; of a triangle the last is corner 2 again.
    corner: [[[f32; 16]; 3]; 4],
    /// Of each face the patch that it is.
    pub patch: [u32; 16],
    /// Lanes that hold a face.
    pub lanes: u16,
    two_sided: u16,
    /// Faces of four corners.
    quads: u16,
}

impl LooseFaces {
    /// Those of some patches of one face, at most sixteen.
    pub fn new(numbers: &[u32], patches: &[Patch], faces: &[Face], vertices: &Vertices) -> LooseFaces {
        let corner = [[[0.0; 16]; 3]; 4];
        let mut loose = LooseFaces { corner, patch: [0; 16], lanes: 0, two_sided: 0, quads: 0 };
        for (lane, &number) in numbers.iter().enumerate() {
            let patch = &patches[number as usize];
            loose.patch[lane] = number;
            loose.set(lane, &faces[patch.first_face as usize], vertices, patch.first_vertex);
        }
        loose
    }

    /// The smallest coordinates of each face (axis, lane), and the largest.
    pub fn sides(&self) -> [[[f32; 16]; 3]; 2] {
        let [a, b, c, d] = &self.corner;
        let of = |pick: fn(f32, f32) -> f32| {
            let of_lane = |axis: usize, lane: usize| {
                pick(pick(a[axis][lane], b[axis][lane]), pick(c[axis][lane], d[axis][lane]))
            };
            std::array::from_fn(|axis| std::array::from_fn(|lane| of_lane(axis, lane)))
        };
        [of(f32::min), of(f32::max)]
    }

    /// The box around all.
    pub fn bounds(&self) -> Box3 {
        let [low, high] = self.sides();
        let of_lane = |lane: usize| Box3 { min: low.map(|a| a[lane]), max: high.map(|a| a[lane]) };
        (0..16)
            .filter(|lane| self.lanes >> lane & 1 == 1)
            .fold(Box3::EMPTY, |b, lane| b.union(&of_lane(lane)))
    }

    fn set(&mut self, lane: usize, face: &Face, vertices: &Vertices, first: u32) {
        for k in 0..4 {
            let k_of_face = if face.corners == 3 { k.min(2) } else { k };
            let v = (first + face.corner[k_of_face]) as usize;
            for (axis, list) in [&vertices.x, &vertices.y, &vertices.z].into_iter().enumerate() {
                self.corner[k][axis][lane] = list[v];
            }
        }
        self.lanes |= 1 << lane;
        self.two_sided |= u16::from(face.two_sided) << lane;
        self.quads |= u16::from(face.corners == 4) << lane;
    }
}

/// What limits the columns that a row covers on one side: `base + per_row·(y − y0)`, y a row of the image.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Bounds {
    base: [[f32; 16]; 4],
    per_row: [[f32; 16]; 4],
}

/// Sixteen faces on the screen, ready to be filled; kept from block to block.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Sixteen {
    left: Bounds,
    right: Bounds,
    y0: [[f32; 16]; 4],
    /// Rows of the image that may hold pixels that are covered.
    top: [i32; 16],
    bottom: [i32; 16],
    /// First and last column that the face touches.
    first: [i32; 16],
    last: [i32; 16],
    /// The plane over pixels of the image that is nowhere above the face.
    plane: [[f64; 16]; 3],
    nearest: [f32; 16],
}

/// No column of an image is so far away.
const FAR: f32 = 65536.0;

impl Default for Sixteen {
    fn default() -> Sixteen {
        let bounds = Bounds { base: [[0.0; 16]; 4], per_row: [[0.0; 16]; 4] };
        Sixteen {
            left: bounds,
            right: bounds,
            y0: [[0.0; 16]; 4],
            top: [0; 16],
            bottom: [0; 16],
            first: [0; 16],
            last: [0; 16],
            plane: [[0.0; 16]; 3],
            nearest: [0.0; 16],
        }
    }
}

/// How sixteen faces came out.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sorted {
    /// Lanes to fill.
    pub draw: u16,
    /// Lanes that reach the near plane or leave the guard band, not set up.
    pub clip: u16,
}

/// Corners of eight faces: homogeneous, then on the screen.
#[derive(Clone, Copy)]
struct Eight<S: Simd> {
    x: [f64x8<S>; 4],
    y: [f64x8<S>; 4],
    /// W (1 if orthographic), then depth.
    d: [f64x8<S>; 4],
}

/// Sets up the faces of a block; those that touch fewer columns or rows than are worth it, and one more, are left
/// out. With a margin all are eroded by what moves the nearest.
#[inline(always)]
pub(super) fn set_up<S: Simd>(simd: S, faces: &LooseFaces, standing: &Standing, out: &mut Sixteen) -> Sorted {
    let (at, least_px) = (&standing.at, standing.least_px);
    let mut halves = widen(simd, faces, at);
    let (clip_low, least_low) = divide(simd, &mut halves[0], at);
    let (clip_high, least_high) = divide(simd, &mut halves[1], at);
    let clip = (clip_low | clip_high << 8) & faces.lanes;
    let least_w = match at.perspective {
        true => least_of(clip | !faces.lanes, least_low, least_high).max(at.d[3]),
        false => 1.0,
    };
    let mut sorted = Sorted { draw: faces.lanes & !clip, clip };
    if sorted.draw == 0 || !least_w.is_finite() {
        sorted.draw = 0;
        return sorted;
    }
    let Some(mut placing) = Placing::new(at, &standing.sizes, least_w) else { return Sorted::default() };
    if standing.margin.is_some() {
        match standing.erosion_from(standing.sizes.least_w(least_w)) {
            Some(erosion) if at.perspective => placing.slack += erosion,
            // They are patches like others.
            _ => return Sorted { draw: 0, clip: faces.lanes },
        }
    }
    for half in &mut halves {
        snap(simd, half, &placing);
    }
    let (x, y) = (whole(simd, &halves[0].x, &halves[1].x), whole(simd, &halves[0].y, &halves[1].y));
    let slack = placing.slack;
    let first = least(&x);
    let last = greatest(&x);
    let (lowest, highest) = (least(&y), greatest(&y));
    let first = (first - (slack + 1)) >> 8;
    let last = (last + slack) >> 8;
    let (first_row, last_row) = ((lowest - (slack + 1)) >> 8, (highest + slack) >> 8);
    let wide = (last - first).simd_ge(2) & (last_row - first_row).simd_ge(2);
    let large = wide & (last - first).simd_ge(least_px) & (last_row - first_row).simd_ge(least_px);
    let (low, high) = (turns(simd, &halves[0]), turns(simd, &halves[1]));
    let (positive, negative) = (low[0] | high[0] << 8, low[1] | high[1] << 8);
    let front = if at.front_sign > 0.0 { positive } else { negative };
    let facing = front | ((positive | negative) & faces.two_sided);
    sorted.draw &= facing & large.to_bitmask() as u16;
    if sorted.draw == 0 {
        return sorted;
    }
    first.store_slice(&mut out.first);
    last.store_slice(&mut out.last);
    ((lowest + (slack + 255)) >> 8).store_slice(&mut out.top);
    (((highest - slack) >> 8) - 1).store_slice(&mut out.bottom);
    let rows = (last_row - first_row).to_float::<f32x16<S>>() + 1.0;
    set_bounds(simd, &x, &y, negative, slack, rows, out);
    for (half, corners) in halves.iter().enumerate() {
        set_planes(simd, corners, slack, half * 8, out);
    }
    sorted
}

#[inline(always)]
fn widen<S: Simd>(simd: S, faces: &LooseFaces, at: &ScreenFromObject) -> [Eight<S>; 2] {
    let zero = f64x8::splat(simd, 0.0);
    let mut halves = [Eight { x: [zero; 4], y: [zero; 4], d: [zero; 4] }; 2];
    // Corner 3 of triangles is corner 2.
    let count = if faces.quads == 0 { 3 } else { 4 };
    for k in 0..count {
        let x = simd.widen_f32x16(f32x16::from_slice(simd, &faces.corner[k][0]));
        let y = simd.widen_f32x16(f32x16::from_slice(simd, &faces.corner[k][1]));
        let z = simd.widen_f32x16(f32x16::from_slice(simd, &faces.corner[k][2]));
        for (half, p) in [[x.0, y.0, z.0], [x.1, y.1, z.1]].into_iter().enumerate() {
            halves[half].x[k] = dot(simd, &at.x, &p);
            halves[half].y[k] = dot(simd, &at.y, &p);
            halves[half].d[k] = dot(simd, if at.perspective { &at.w } else { &at.d }, &p);
        }
    }
    if count == 3 {
        for half in &mut halves {
            (half.x[3], half.y[3], half.d[3]) = (half.x[2], half.y[2], half.d[2]);
        }
    }
    halves
}

/// Divides by W. Returns lanes that need clipping, and the least W of each lane; `d` becomes depth, not rounded.
#[inline(always)]
fn divide<S: Simd>(simd: S, half: &mut Eight<S>, at: &ScreenFromObject) -> (u16, f64x8<S>) {
    let (low, high) = (f64x8::splat(simd, GUARD_MIN * 256.0), f64x8::splat(simd, GUARD_MAX * 256.0));
    let near = f64x8::splat(simd, at.d[3]);
    let one = f64x8::splat(simd, 1.0);
    let mut inside = 0xFFu64;
    let mut least = if at.perspective { half.d[0] } else { one };
    for k in 0..4 {
        if at.perspective {
            let w = half.d[k];
            least = least.min(w);
            let reciprocal = one / w;
            half.x[k] *= reciprocal;
            half.y[k] *= reciprocal;
            half.d[k] = reciprocal * near;
            inside &= near.simd_le(w).to_bitmask();
        } else {
            inside &= half.d[k].simd_le(one).to_bitmask();
        }
        inside &= (half.x[k].simd_ge(low) & half.x[k].simd_le(high)).to_bitmask();
        inside &= (half.y[k].simd_ge(low) & half.y[k].simd_le(high)).to_bitmask();
    }
    (!inside as u16 & 0xFF, least)
}

/// The least of sixteen numbers, but for those of the lanes that are set apart.
#[inline(always)]
fn least_of<S: Simd>(apart: u16, low: f64x8<S>, high: f64x8<S>) -> f64 {
    let halves: [[f64; 8]; 2] = [low.into(), high.into()];
    let mut least = f64::INFINITY;
    for (lane, w) in halves.as_flattened().iter().enumerate() {
        if apart >> lane & 1 == 0 {
            least = least.min(*w);
        }
    }
    least
}

/// Snaps corners to whole numbers and rounds depths away from the eye.
#[inline(always)]
fn snap<S: Simd>(simd: S, half: &mut Eight<S>, placing: &Placing) {
    let round = f64x8::splat(simd, ROUND);
    for k in 0..4 {
        half.x[k] = half.x[k] + round - round;
        half.y[k] = half.y[k] + round - round;
        half.d[k] = placing.depths(simd, half.d[k]);
    }
}

#[inline(always)]
fn whole<S: Simd>(simd: S, low: &[f64x8<S>; 4], high: &[f64x8<S>; 4]) -> [i32x16<S>; 4] {
    let round = f64x8::splat(simd, ROUND);
    let mut out = [i32x16::splat(simd, 0); 4];
    for k in 0..4 {
        out[k] = simd.narrow_i64x8((low[k] + round).bitcast(), (high[k] + round).bitcast());
    }
    out
}

#[inline(always)]
fn least<S: Simd>(v: &[i32x16<S>; 4]) -> i32x16<S> {
    v[0].min(v[1]).min(v[2].min(v[3]))
}

#[inline(always)]
fn greatest<S: Simd>(v: &[i32x16<S>; 4]) -> i32x16<S> {
    v[0].max(v[1]).max(v[2].max(v[3]))
}

/// Lanes whose corners all turn one way, then those that all turn the other; exact, as products have 48 bits.
#[inline(always)]
fn turns<S: Simd>(simd: S, half: &Eight<S>) -> [u16; 2] {
    let zero = f64x8::splat(simd, 0.0);
    let (x, y) = (&half.x, &half.y);
    let (mut low, mut high) = (zero, zero);
    for k in 0..4 {
        let (a, b, c) = (k, (k + 1) & 3, (k + 2) & 3);
        let area = (x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a]);
        (low, high) = (low.min(area), high.max(area));
    }
    let (some_low, some_high) = (low.simd_lt(zero).to_bitmask(), high.simd_gt(zero).to_bitmask());
    [(some_high & !some_low) as u16, (some_low & !some_high) as u16]
}

/// The edges' bounds, with corners 1 and 3 exchanged where `negative` says so.
#[inline(always)]
fn set_bounds<S: Simd>(
    simd: S,
    x: &[i32x16<S>; 4],
    y: &[i32x16<S>; 4],
    negative: u16,
    slack: i32,
    rows: f32x16<S>,
    out: &mut Sixteen,
) {
    let swap = mask32x16::from_bitmask(simd, u64::from(negative));
    let x = [x[0], swap.select(x[3], x[1]), x[2], swap.select(x[1], x[3])];
    let y = [y[0], swap.select(y[3], y[1]), y[2], swap.select(y[1], y[3])];
    let sub = 1.0 / 256.0;
    let reach = (128 + slack) as f32 * sub;
    let zero = f32x16::splat(simd, 0.0);
    let (far_left, far_right) = (f32x16::splat(simd, -FAR), f32x16::splat(simd, FAR));
    let rounding = 1.0 / (1 << 20) as f32;
    for k in 0..4 {
        let next = (k + 1) & 3;
        let dx = (x[next] - x[k]).to_float::<f32x16<S>>();
        let dy = (y[next] - y[k]).to_float::<f32x16<S>>();
        let (is_left, is_right) = (dy.simd_lt(0.0), dy.simd_gt(0.0));
        let (px, py) = (x[k].to_float::<f32x16<S>>() * sub, y[k].to_float::<f32x16<S>>() * sub);
        let m = dx / dy;
        let half = (m.abs() + 1.0) * reach;
        // Over all rows of the face, no term is larger than these together.
        let off = (px.abs() + 1.0 + half + m.abs() * rows) * rounding;
        let inwards = half + off;
        let level = !(is_left | is_right);
        let slope = level.select(zero, m);
        is_left.select(px - 0.5 + inwards, far_left).store_slice(&mut out.left.base[k]);
        is_right.select(px - 0.5 - inwards, far_right).store_slice(&mut out.right.base[k]);
        is_left.select(slope, zero).store_slice(&mut out.left.per_row[k]);
        is_right.select(slope, zero).store_slice(&mut out.right.per_row[k]);
        (py - 0.5).store_slice(&mut out.y0[k]);
    }
}

/// Planes of depth, as `fill` makes them: lowered until no corner lies below, then by the fall within a pixel.
#[inline(always)]
fn set_planes<S: Simd>(simd: S, h: &Eight<S>, slack: i32, lane: usize, out: &mut Sixteen) {
    let sub = 1.0 / 256.0;
    let zero = f64x8::splat(simd, 0.0);
    let (mut x, mut y, mut d) = ([zero; 4], [zero; 4], [zero; 4]);
    for k in 1..4 {
        (x[k], y[k], d[k]) = ((h.x[k] - h.x[0]) * sub, (h.y[k] - h.y[0]) * sub, h.d[k] - h.d[0]);
    }
    // The larger of the two triangles along the diagonal from corner 0.
    let (area, other) = (x[1] * y[2] - x[2] * y[1], x[2] * y[3] - x[3] * y[2]);
    let second = other.abs().simd_gt(area.abs());
    let (x1, y1, d1) = (second.select(x[2], x[1]), second.select(y[2], y[1]), second.select(d[2], d[1]));
    let (x2, y2, d2) = (second.select(x[3], x[2]), second.select(y[3], y[2]), second.select(d[3], d[2]));
    let per = f64x8::splat(simd, 1.0) / second.select(other, area);
    let (a, b) = ((d1 * y2 - d2 * y1) * per, (d2 * x1 - d1 * x2) * per);
    let sane = a.abs().simd_lt(1e6) & b.abs().simd_lt(1e6);
    let (a, b) = (sane.select(a, zero), sane.select(b, zero));
    let mut excess = zero;
    let (mut nearest, mut size) = (h.d[0], h.d[0].abs());
    for k in 1..4 {
        excess = excess.max(a * x[k] + b * y[k] - d[k]);
        nearest = nearest.max(h.d[k]);
        size = size.max(h.d[k].abs());
    }
    let fall = (a.abs() + b.abs()) * (0.5 + f64::from(slack) * sub) + size * 1e-12;
    let (x0, y0) = (h.x[0] * sub - 0.5, h.y[0] * sub - 0.5);
    let c = h.d[0] - a * x0 - b * y0 - excess - fall;
    for (list, v) in out.plane.iter_mut().zip([a, b, c]) {
        v.store_slice(&mut list[lane..][..8]);
    }
    let nearest: [f64; 8] = nearest.into();
    for (to, nearest) in out.nearest[lane..][..8].iter_mut().zip(nearest) {
        // Rounded up: nothing of the face is nearer.
        *to = (nearest as f32).next_up();
    }
}

/// Fills one of sixteen faces: of the cells that it meets the tiles where something is farther.
#[inline(always)]
pub(super) fn fill_one<S: Simd>(simd: S, surface: &mut Surface, faces: &Sixteen, lane: usize) {
    let top = (faces.top[lane] - surface.top).max(0);
    let bottom = (faces.bottom[lane] - surface.top).min(surface.height - 1);
    let (first, last) = (faces.first[lane].max(0), faces.last[lane].min(surface.width - 1));
    if top > bottom || first > last {
        return;
    }
    let plane = [faces.plane[0][lane], faces.plane[1][lane], faces.plane[2][lane]];
    let nearest = faces.nearest[lane];
    for cell_y in top >> 6..(bottom >> 6) + 1 {
        for cell_x in first >> 6..(last >> 6) + 1 {
            let mut open = surface.tiles_beyond(simd, cell_x, cell_y, [first, top, last, bottom], nearest);
            while open != 0 {
                let tile_row = open.trailing_zeros() as i32 >> 2;
                let columns = open >> (tile_row * 4) & 15;
                open &= !(15 << (tile_row * 4));
                let y = cell_y * 64 + tile_row * 16;
                let inside = (0xFFFFu32 << (top - y).max(0)) & (0xFFFF >> (15 - (bottom - y).min(15)));
                let spans = spans(simd, faces, lane, (y + surface.top) as f32, inside);
                let place = [cell_x * 64, y];
                fill_tiles(simd, surface, &spans, columns, place, [first, top, last, bottom], plane, nearest);
            }
        }
    }
}

/// Fills those of four tiles of a row, from `x` on, that `columns` names. The face lies in `rect`.
#[expect(clippy::too_many_arguments, reason = "the inner step of one loop, split off")]
#[inline(always)]
fn fill_tiles<S: Simd>(
    simd: S,
    surface: &mut Surface,
    (from, to): &(f32x16<S>, f32x16<S>),
    columns: u32,
    [x, y]: [i32; 2],
    rect: [i32; 4],
    plane: [f64; 3],
    nearest: f32,
) {
    let mut rest = columns;
    while rest != 0 {
        let x = x + rest.trailing_zeros() as i32 * 16;
        rest &= rest - 1;
        let (x_first, x_last) = (x as f32, (x + 15) as f32);
        let meets = (from.simd_le(x_last) & to.simd_ge(x_first) & from.simd_le(*to)).to_bitmask() as u32;
        if meets == 0 {
            continue;
        }
        let tile = surface.tile(x >> 4, y >> 4);
        let over = tile_plane(plane, x, y + surface.top);
        let highest = nearest.min(over.max());
        let [left, top, right, bottom] = rect;
        let inner = [(left - x).max(0), (top - y).max(0), (right - x).min(15), (bottom - y).min(15)];
        surface.refresh_tile(simd, tile);
        if !surface.may_gain(simd, tile, inner, highest) {
            continue;
        }
        if meets == 0xFFFF && (from.simd_le(x_first) & to.simd_ge(x_last)).all_true() {
            surface.cover(simd, tile, over);
        } else {
            let depths = over.rows(simd);
            surface.raise_spans(
                simd,
                tile,
                [*from - x_first, *to - x_first],
                meets,
                #[inline(always)]
                |row| depths.row(simd, row),
                highest,
            );
        }
    }
}

/// First and last column that each of sixteen rows covers, from row `y` of the image on: of those in `inside`.
#[inline(always)]
fn spans<S: Simd>(simd: S, faces: &Sixteen, lane: usize, y: f32, inside: u32) -> (f32x16<S>, f32x16<S>) {
    let rows = f32x16::from_slice(simd, &COLUMNS) + y;
    let (mut from, mut to) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, FAR));
    for k in 0..4 {
        let down = rows - faces.y0[k][lane];
        from = from.max(down * faces.left.per_row[k][lane] + faces.left.base[k][lane]);
        to = to.min(down * faces.right.per_row[k][lane] + faces.right.base[k][lane]);
    }
    let far = f32x16::splat(simd, FAR);
    let inside = mask32x16::from_bitmask(simd, u64::from(inside));
    (inside.select(from.min(far).ceil(), far), to.max(f32x16::splat(simd, -1.0)).floor())
}
