//! Filling a face: which pixels it covers wholly, and what its part is in those that its patch covers with
//! several faces together. The proof is in [`super`].
//!
//! ```text
//! face     plane of depth, lowered until it is below every corner; edges as functions of pixels
//! small    (up to 16×16 pixels, with an edge shared) into the joint, row by row
//! large    tile by tile: outside; wholly inside, a plane; else the edges that cross the tile, row by row:
//!            pixels wholly inside  → the surface
//!            pixels touched        → the joint, if an edge that crosses the tile is shared
//! patch    the joint: pixels whose count is at least one get the least depth of all faces that touch them
//! ```
//!
//! An edge is `E = A·(X − x) + B·(Y − y)`, positive inside, on snapped coordinates; at pixel centres
//! `e = ⌊(E + bias) / 256⌋ = A·px + B·py + C` is a whole number with whole steps, and `e ≥ 0` is the fill
//! rule exactly. A pixel's square, widened by the slack, reaches `h = (|A| + |B|)·(128 + slack)` from there.

use super::surface::{Surface, TilePlane};
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*};

/// A corner on the screen: 1/256 pixel, and a depth that is no larger than the true one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub x: i32,
    pub y: i32,
    pub depth: f32,
}

/// A convex polygon of three or four corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    pub corner: [Corner; 4],
    pub corners: usize,
    /// 1 if the corners run so that E is positive inside, −1 if they run the other way.
    pub turn: i32,
    /// Bit k: the surface ends at the edge from corner k to the next.
    pub ends: u32,
}

/// What a patch covers jointly, pixel by pixel, until it is finished.
#[derive(Clone, Debug, Default)]
pub(super) struct Joint {
    stride: usize,
    /// Least depth of the faces that touch a pixel.
    depth: Vec<f32>,
    /// How often the faces cover its centre, less what may be lost on the way to its other points.
    count: Vec<i32>,
    is_dirty: Vec<bool>,
    dirty: Vec<u32>,
}

impl Joint {
    pub fn new(surface: &Surface) -> Joint {
        // Rows of sixteen may begin at any pixel of the last tile.
        let stride = surface.tiles_x() as usize * 16 + 16;
        let pixels = stride * (surface.tiles_y() as usize * 16);
        let tiles = (surface.tiles_x() * surface.tiles_y()) as usize;
        Joint {
            stride,
            depth: vec![f32::INFINITY; pixels],
            count: vec![0; pixels],
            is_dirty: vec![false; tiles],
            dirty: Vec::new(),
        }
    }

    #[inline(always)]
    fn mark(&mut self, tile: usize) {
        if !self.is_dirty[tile] {
            self.is_dirty[tile] = true;
            self.dirty.push(tile as u32);
        }
    }

    /// Writes what the patch covers to the surface and empties the joint.
    #[inline(always)]
    pub fn finish<S: Simd>(&mut self, simd: S, surface: &mut Surface, nearest: f32) {
        let one = i32x16::splat(simd, 1);
        while let Some(tile) = self.dirty.pop() {
            let tile = tile as usize;
            self.is_dirty[tile] = false;
            let gains = surface.tile_min(tile) < nearest;
            let (x, y) = surface.corner(tile);
            let mut wrote = false;
            for row in 0..16 {
                let at = (y + row) as usize * self.stride + x as usize;
                let count = i32x16::from_slice(simd, &self.count[at..at + 16]);
                let whole = count.simd_ge(one);
                if gains && whole.any_true() {
                    if !wrote {
                        surface.open(simd, tile);
                        wrote = true;
                    }
                    let depth = f32x16::from_slice(simd, &self.depth[at..at + 16]);
                    surface.raise(simd, tile, row, depth, whole);
                }
                i32x16::splat(simd, 0).store_slice(&mut self.count[at..at + 16]);
                f32x16::splat(simd, f32::INFINITY).store_slice(&mut self.depth[at..at + 16]);
            }
            if wrote {
                surface.raised(tile, nearest);
            }
        }
    }

    /// As [`Joint::finish`], but a pixel gets the least depth of all within `radius` pixels, and nothing
    /// where one of these is not covered or not in the image.
    pub fn finish_eroded<S: Simd>(&mut self, simd: S, surface: &mut Surface, nearest: f32, radius: i32) {
        let corners = self.dirty.iter().map(|&t| surface.corner(t as usize));
        let none = [i32::MAX, i32::MAX, 0, 0];
        let [left, top, right, bottom] =
            corners.fold(none, |[l, t, r, b], (x, y)| [l.min(x), t.min(y), r.max(x + 16), b.max(y + 16)]);
        if left >= right {
            return;
        }
        let (right, bottom) = (right.min(surface.width), bottom.min(surface.height));
        let (width, height) = ((right - left) as usize, (bottom - top) as usize);
        let mut depths = Vec::with_capacity(width * height);
        for y in top..bottom {
            let at = y as usize * self.stride + left as usize;
            let mut row: Vec<f32> =
                (at..at + width).map(|i| if self.count[i] >= 1 { self.depth[i] } else { 0.0 }).collect();
            erode(&mut row, 1, radius as usize);
            depths.extend(row);
        }
        erode(&mut depths, width, radius as usize);
        for tile in self.dirty.drain(..) {
            let tile = tile as usize;
            self.is_dirty[tile] = false;
            let (x, y) = surface.corner(tile);
            surface.open(simd, tile);
            for row in 0..16 {
                let at = (y + row) as usize * self.stride + x as usize;
                self.count[at..at + 16].fill(0);
                self.depth[at..at + 16].fill(f32::INFINITY);
                if y + row < bottom {
                    let mut depth = [0.0; 16];
                    let columns = (right - x).min(16) as usize;
                    let from = (y + row - top) as usize * width + (x - left) as usize;
                    depth[..columns].copy_from_slice(&depths[from..from + columns]);
                    let depth = f32x16::from_slice(simd, &depth);
                    surface.raise(simd, tile, row, depth, mask32x16::from_bitmask(simd, 0xFFFF));
                }
            }
            surface.raised(tile, nearest);
        }
    }
}

/// Least values over windows of 2·radius + 1 elements, each `width` wide; beyond both ends is 0.
fn erode(values: &mut Vec<f32>, width: usize, radius: usize) {
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

/// An edge over the surface's pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    a: i32,
    b: i32,
    /// e at pixel (0, 0).
    c: i64,
    /// All of a pixel is inside if e is at least this …
    inside: i32,
    /// … and some of it may be if e is at least minus this.
    touch: i32,
    /// The edge may touch a pixel if e is at most this (and at least −`touch`).
    reach: i32,
    /// The true edge may pass a pixel's centre if e is at least minus this.
    sway: i32,
    ends: bool,
    /// Pixels that the edge itself may touch.
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
}

/// A face being filled.
struct Face {
    edge: [Edge; 4],
    edges: usize,
    /// Pixels that the face may touch, surface coordinates, not clipped.
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
    /// Depth is nowhere in pixel (x, y) of the image and the face less than
    /// `plane[0]·x + plane[1]·y + plane[2]`, nor than `farthest`.
    plane: [f64; 3],
    farthest: f32,
    nearest: f32,
    /// First image row of the surface. The plane counts from the image's, so that bands hold the same bits.
    band: i32,
}

impl Face {
    #[inline(always)]
    fn new(outline: &Outline, slack: i32, top: i32) -> Face {
        let n = outline.corners;
        let c = &outline.corner;
        let mut face = Face {
            edge: [Edge::default(); 4],
            edges: n,
            left: i32::MAX,
            top: i32::MAX,
            right: i32::MIN,
            bottom: i32::MIN,
            plane: [0.0; 3],
            farthest: f32::INFINITY,
            nearest: f32::NEG_INFINITY,
            band: top,
        };
        for corner in &c[..n] {
            face.left = face.left.min(corner.x);
            face.top = face.top.min(corner.y);
            face.right = face.right.max(corner.x);
            face.bottom = face.bottom.max(corner.y);
            face.farthest = face.farthest.min(corner.depth);
            face.nearest = face.nearest.max(corner.depth);
        }
        (face.left, face.right) = (first_pixel(face.left, slack), last_pixel(face.right, slack));
        (face.top, face.bottom) = (first_pixel(face.top, slack) - top, last_pixel(face.bottom, slack) - top);
        face
    }

    #[inline(always)]
    fn set_edges(&mut self, outline: &Outline, slack: i32, top: i32) {
        for k in 0..self.edges {
            let (p, q) = (&outline.corner[k], &outline.corner[(k + 1) % self.edges]);
            self.edge[k] = edge(p, q, outline.turn, slack, top, outline.ends >> k & 1 == 1);
        }
    }

    /// A plane through three corners, lowered until no corner lies below it, then by what it falls within a
    /// pixel: where the face is, any plane is at most the largest of its excesses at the corners too high.
    #[inline(always)]
    fn set_plane(&mut self, outline: &Outline, slack: i32) {
        let c = &outline.corner;
        // The larger of the two triangles along the diagonal from corner 0.
        let doubled = |i: usize, j: usize| {
            (f64::from(c[i].x) - f64::from(c[0].x)) * (f64::from(c[j].y) - f64::from(c[0].y))
                - (f64::from(c[j].x) - f64::from(c[0].x)) * (f64::from(c[i].y) - f64::from(c[0].y))
        };
        let (mut i, mut j, mut area) = (1, 2, doubled(1, 2));
        if self.edges == 4 {
            let other = doubled(2, 3);
            if other.abs() > area.abs() {
                (i, j, area) = (2, 3, other);
            }
        }
        let sub = 1.0 / 256.0;
        let rel = |k: usize| {
            let (x, y) = (f64::from(c[k].x) - f64::from(c[0].x), f64::from(c[k].y) - f64::from(c[0].y));
            (x * sub, y * sub, f64::from(c[k].depth) - f64::from(c[0].depth))
        };
        let ((x1, y1, d1), (x2, y2, d2)) = (rel(i), rel(j));
        let per = 65536.0 / area;
        let (mut a, mut b) = ((d1 * y2 - d2 * y1) * per, (d2 * x1 - d1 * x2) * per);
        if !(a.abs() < 1e6 && b.abs() < 1e6) {
            (a, b) = (0.0, 0.0);
        }
        let mut excess = 0.0f64;
        for k in 1..self.edges {
            let (x, y, d) = rel(k);
            excess = excess.max(a * x + b * y - d);
        }
        let fall = (a.abs() + b.abs()) * (0.5 + f64::from(slack) * sub)
            + f64::from(self.nearest.abs().max(self.farthest.abs())) * 1e-12;
        // From corner 0 to the centre of pixel (0, 0).
        let (x0, y0) = (f64::from(c[0].x) * sub - 0.5, f64::from(c[0].y) * sub - 0.5);
        let at_zero = f64::from(c[0].depth) - a * x0 - b * y0;
        self.plane = [a, b, at_zero - excess - fall];
    }

    /// The plane over a tile, lowered by more than the roundings of its use.
    #[inline(always)]
    fn tile_plane(&self, x: i32, y: i32) -> TilePlane {
        let [a, b, c] = self.plane;
        let (x, y) = (f64::from(x), f64::from(y + self.band));
        let origin = c + a * x + b * y;
        let size = origin.abs() + 16.0 * (a.abs() + b.abs());
        let size = size + (c.abs() + a.abs() * x.abs() + b.abs() * y.abs()) * 1e-12;
        let origin = (origin - size * (1.0 / f64::from(1 << 20))) as f32;
        TilePlane { origin, per_column: a as f32, per_row: b as f32 }
    }
}

/// First pixel whose square, widened by the slack, reaches a coordinate.
#[inline(always)]
fn first_pixel(v: i32, slack: i32) -> i32 {
    (v - slack - 1) >> 8
}

/// Last one.
#[inline(always)]
fn last_pixel(v: i32, slack: i32) -> i32 {
    (v + slack) >> 8
}

#[inline(always)]
fn edge(p: &Corner, q: &Corner, turn: i32, slack: i32, top: i32, ends: bool) -> Edge {
    let (dx, dy) = ((q.x - p.x) * turn, (q.y - p.y) * turn);
    let (a, b) = (-dy, dx);
    // Of an edge and its reverse exactly one owns a point on it.
    let owned = dy < 0 || (dy == 0 && dx > 0);
    let (x, y) = (i64::from(128 - p.x), i64::from(128 + 256 * top - p.y));
    let e = i64::from(a) * x + i64::from(b) * y - i64::from(!owned);
    let size = i64::from(a.abs()) + i64::from(b.abs());
    let h = size * i64::from(128 + slack);
    Edge {
        a,
        b,
        c: e >> 8,
        inside: ((h + 255) >> 8) as i32,
        touch: ((h + 256) >> 8) as i32,
        reach: (h >> 8) as i32,
        sway: ((size * i64::from(slack) + 256) >> 8) as i32,
        ends,
        left: first_pixel(p.x.min(q.x), slack),
        top: first_pixel(p.y.min(q.y), slack) - top,
        right: last_pixel(p.x.max(q.x), slack),
        bottom: last_pixel(p.y.max(q.y), slack) - top,
    }
}

/// Fills one convex face. `slack` is how far a corner may be from its true place, 1/256 pixel. Where the
/// patch is to be eroded, all of it goes `jointly`.
#[inline(always)]
pub(super) fn fill<S: Simd>(
    simd: S,
    surface: &mut Surface,
    joint: &mut Joint,
    outline: &Outline,
    slack: i32,
    jointly: bool,
) {
    let mut face = Face::new(outline, slack, surface.top);
    let all_end = !jointly && outline.ends == (1 << outline.corners) - 1;
    let small = face.right - face.left < 16 && face.bottom - face.top < 16;
    if face.right < 0 || face.bottom < 0 || face.left >= surface.width || face.top >= surface.height {
        return;
    }
    if all_end && (face.right - face.left < 2 || face.bottom - face.top < 2) {
        // It touches at most two columns or rows; one that covers a pixel touches its neighbours too.
        return;
    }
    face.set_edges(outline, slack, surface.top);
    if small && !all_end {
        if face.right - face.left < 4 && face.bottom - face.top < 4 {
            // Within so few pixels its farthest corner is as good a bound.
            face.plane = [0.0, 0.0, f64::from(face.farthest)];
        } else {
            face.set_plane(outline, slack);
        }
        fill_small(simd, surface, joint, &face);
    } else {
        face.set_plane(outline, slack);
        fill_tiles(simd, surface, joint, &face, jointly);
    }
}

#[inline(always)]
fn columns_i32<S: Simd>(simd: S) -> i32x16<S> {
    i32x16::from_slice(simd, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
}

/// Bits `from` to `to` (inclusive, clipped to 0..16).
#[inline(always)]
fn column_bits(from: i32, to: i32) -> u64 {
    let (from, to) = (from.max(0), to.min(15));
    if from > to { 0 } else { (0xFFFFu64 << from) & (0xFFFF >> (15 - to)) }
}

#[inline(always)]
fn fill_small<S: Simd>(simd: S, surface: &Surface, joint: &mut Joint, face: &Face) {
    let (x0, y0) = (face.left.max(0), face.top.max(0));
    let (x1, y1) = (face.right.min(surface.width - 1), face.bottom.min(surface.height - 1));
    for tile_y in y0 >> 4..=y1 >> 4 {
        for tile_x in x0 >> 4..=x1 >> 4 {
            joint.mark(surface.tile(tile_x, tile_y));
        }
    }
    let columns = mask32x16::from_bitmask(simd, column_bits(0, x1 - x0));
    let plane = face.tile_plane(x0, face.top);
    rows_into_joint(simd, joint, face, 0b1111, [x0, y0, y1], (plane, face.top), columns);
}

/// Adds a face to the joint in up to sixteen columns from x0 and the rows from y0 to y1. `edges` are those
/// that cross there.
#[inline(always)]
fn rows_into_joint<S: Simd>(
    simd: S,
    joint: &mut Joint,
    face: &Face,
    edges: u32,
    [x0, y0, y1]: [i32; 3],
    (plane, plane_top): (TilePlane, i32),
    columns: mask32x16<S>,
) {
    let zero = i32x16::splat(simd, 0);
    let column = columns_i32(simd);
    let mut e = [zero; 4];
    for k in 0..face.edges {
        e[k] = column * face.edge[k].a + at_saturated(&face.edge[k], x0, y0);
    }
    let farthest = f32x16::splat(simd, face.farthest);
    for y in y0..=y1 {
        let (mut centre, mut touch) = (zero, zero);
        for k in 0..face.edges {
            if edges >> k & 1 == 1 {
                centre |= e[k];
                touch |= e[k] + face.edge[k].touch;
            }
        }
        let touched = touch.simd_ge(zero) & columns;
        if touched.any_true() {
            let at = y as usize * joint.stride + x0 as usize;
            let depths = &mut joint.depth[at..at + 16];
            let old = f32x16::from_slice(simd, depths);
            let depth = plane.row(simd, y - plane_top).max(farthest);
            touched.select(old.min(depth), old).store_slice(depths);
            let counts = &mut joint.count[at..at + 16];
            let mut count = i32x16::from_slice(simd, counts);
            let covered = centre.simd_ge(zero) & columns;
            count = covered.select(count + 1, count);
            for k in 0..face.edges {
                let edge = &face.edge[k];
                if edges >> k & 1 == 1 && edge.ends && y >= edge.top && y <= edge.bottom {
                    let along = column_bits(edge.left - x0, edge.right - x0);
                    let lost = e[k].simd_ge(i32x16::splat(simd, -edge.sway))
                        & e[k].simd_le(i32x16::splat(simd, edge.reach))
                        & columns
                        & mask32x16::from_bitmask(simd, along);
                    count = lost.select(count - 1, count);
                }
            }
            count.store_slice(counts);
        }
        for k in 0..face.edges {
            e[k] += face.edge[k].b;
        }
    }
}

#[inline(always)]
fn at(edge: &Edge, x: i32, y: i32) -> i64 {
    i64::from(edge.a) * i64::from(x) + i64::from(edge.b) * i64::from(y) + edge.c
}

/// Saturated so that steps within a tile cannot overflow and no sign or comparison changes.
#[inline(always)]
fn at_saturated(edge: &Edge, x: i32, y: i32) -> i32 {
    at(edge, x, y).clamp(-(1 << 30), (1 << 30) - 1) as i32
}

#[inline(always)]
fn fill_tiles<S: Simd>(simd: S, surface: &mut Surface, joint: &mut Joint, face: &Face, jointly: bool) {
    let (left, top) = (face.left.max(0) >> 4, face.top.max(0) >> 4);
    let (right, bottom) = (face.right.min(surface.width - 1) >> 4, face.bottom.min(surface.height - 1) >> 4);
    for tile_y in top..=bottom {
        for tile_x in left..=right {
            let (x, y) = (tile_x * 16, tile_y * 16);
            let (mut crossing, mut shared, mut outside) = (0u32, false, false);
            for (k, edge) in face.edge[..face.edges].iter().enumerate() {
                let e = at(edge, x, y);
                let up = i64::from(edge.a.max(0) + edge.b.max(0)) * 15;
                let down = i64::from(edge.a.min(0) + edge.b.min(0)) * 15;
                outside |= e + up < i64::from(-edge.touch);
                if e + down < i64::from(edge.inside) {
                    crossing |= 1 << k;
                    shared |= !edge.ends;
                }
            }
            if !outside {
                let tile = surface.tile(tile_x, tile_y);
                let plane = face.tile_plane(x, y);
                if jointly {
                    into_joint(simd, surface, joint, face, tile, [x, y], plane, crossing);
                } else if crossing == 0 {
                    surface.cover(simd, tile, plane);
                } else {
                    fill_tile(simd, surface, joint, face, tile, [x, y], plane, crossing, shared);
                }
            }
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "the inner step of one loop, split off to be called twice")]
#[inline(always)]
fn into_joint<S: Simd>(
    simd: S,
    surface: &Surface,
    joint: &mut Joint,
    face: &Face,
    tile: usize,
    [x, y]: [i32; 2],
    plane: TilePlane,
    crossing: u32,
) {
    joint.mark(tile);
    let columns = mask32x16::from_bitmask(simd, column_bits(face.left - x, face.right - x));
    let rows = [x, face.top.max(y), face.bottom.min(y + 15).min(surface.height - 1)];
    rows_into_joint(simd, joint, face, crossing, rows, (plane, y), columns);
}

#[expect(clippy::too_many_arguments, reason = "the inner step of one loop, split off to be read")]
#[inline(always)]
fn fill_tile<S: Simd>(
    simd: S,
    surface: &mut Surface,
    joint: &mut Joint,
    face: &Face,
    tile: usize,
    [x, y]: [i32; 2],
    plane: TilePlane,
    crossing: u32,
    shared: bool,
) {
    if shared {
        into_joint(simd, surface, joint, face, tile, [x, y], plane, crossing);
    }
    if surface.tile_min(tile) >= face.nearest {
        return;
    }
    let zero = i32x16::splat(simd, 0);
    let column = columns_i32(simd);
    let mut e = [zero; 4];
    let mut used = 0;
    let mut steps = [0; 4];
    for k in 0..face.edges {
        if crossing >> k & 1 == 1 {
            let edge = &face.edge[k];
            e[used] = column * edge.a + (at_saturated(edge, x, y) - edge.inside);
            steps[used] = edge.b;
            used += 1;
        }
    }
    let farthest = f32x16::splat(simd, face.farthest);
    let mut wrote = false;
    for row in 0..16 {
        let mut outside = e[0];
        for e in &e[1..used] {
            outside |= *e;
        }
        let inside = outside.simd_ge(zero);
        if inside.any_true() {
            if !wrote {
                surface.open(simd, tile);
                wrote = true;
            }
            let depth = plane.row(simd, row).max(farthest);
            surface.raise(simd, tile, row, depth, inside);
        }
        for k in 0..used {
            e[k] += steps[k];
        }
    }
    if wrote {
        surface.raised(tile, face.nearest);
    }
}
