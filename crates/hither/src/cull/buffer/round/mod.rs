//! Closed convex patches of many faces: balls, barrels, pillars. Only corners on the silhouette are placed, and no face
//! is; depth is from planes in the patch's own space.
//!
//! ```text
//! 1. which faces turn to the eye, sixteen at a time
//! 2. the silhouette: edges of exactly one such face, and its corners in their places
//! 3. coverage: from its edges, as `silhouette` says, whichever faces step 1 takes
//! 4. depth: of all faces that were taken a plane on the screen; in a tile, of those that are the least somewhere, the
//!    least in each block of 4×4
//! ```
//!
//! *Depth.* Each face that was taken stands for the larger of two: its plane, moved inwards until no corner is behind it,
//! at the farthest point of a pixel's square, widened by the slack; and the depth of the farthest point of a ball around
//! it. Both hold wherever the face is; elsewhere they can only lower the least of all. So, as in
//! [`convex`](super::convex), convexity is what makes this good, not what makes it right.
//!
//! *Planes on the screen.* A plane `n·p = d` is seen by an eye e at depth `near·(−n·q(X, Y)) / (n·e − d)`, where
//! `e + W·q(X, Y)` is what is seen at (X, Y) and at a distance of W: linear in X and Y. In an orthographic view it
//! is `(d − n·b(X, Y)) / n·u`, where `b(X, Y) + D·u` is seen there at depth D. With v for `near·q` or b, and s for what is
//! divided by, both are `(k·d − n·v) / s`, and s is more than 0 where the eye is before the plane. The transform is
//! undone in f64, and what is found is put back into it, to see how far it is off: by less than a quarter of 1/256
//! pixel, for which the slack is one more.
//!
//! *Bound.* Sums of three or four products in f32, of numbers rounded once, are off by less than ε = 2⁻²¹ of their terms'
//! magnitudes: numerators anywhere in the patch by δ, together, s by σ. So the quotient is off by less than
//! `(δ + |depth|·σ) / (s − σ)`. Where s is less than 8σ the plane does not count.
//!
//! Nearly half of the time is waiting for what is known of the bodies: see [`body`].

mod body;

pub(super) use body::{Round, RoundBodies};

use super::draw::Standing;
use super::place::{Placed, Placing};
use super::silhouette::{InTile, MOST_EDGES, Silhouette};
use super::surface::Surface;
use super::tile::{BLOCK_COLUMNS, BLOCK_ROWS, TilePlane};
use crate::raster::{GUARD_MAX, ScreenFromObject};
use body::{NORMAL, RoundBody, SixteenFaces};
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*};
use glam::DVec3;

/// What sums in f32 may be off by, as a share of their terms.
const EPS: f32 = 1.0 / (1 << 21) as f32;

/// A round body in its place.
pub(super) struct Drawing<'a> {
    pub body: RoundBody<'a>,
    pub standing: &'a Standing<'a>,
    pub placing: &'a Placing,
    /// Pixels of the image that it may touch.
    pub rect: [i32; 4],
    /// No point of it is nearer, none farther.
    pub nearest: f32,
    pub farthest: f32,
}

/// What is kept from body to body.
#[derive(Clone, Debug, Default)]
pub(super) struct Room {
    /// Of sixteen faces those that turn to the eye.
    front: Vec<u16>,
    /// The ends of the silhouette's edges, as they run around faces that turn to the eye.
    outline: Vec<[u16; 2]>,
    /// Of each vertex where it is the first of an edge.
    place: Vec<u16>,
    seen: Vec<SixteenSeen>,
}

/// Planes of faces that are seen: `a·x + b·y + c` in column x and row y, counted from where [`Sight`] says.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct SixteenSeen {
    a: [f32; 16],
    b: [f32; 16],
    c: [f32; 16],
    /// Lowered by what it falls within a block.
    in_block: [f32; 16],
    /// No point of the face is farther.
    farthest: [f32; 16],
}

impl SixteenSeen {
    const NONE: SixteenSeen =
        SixteenSeen { a: [0.0; 16], b: [0.0; 16], c: [0.0; 16], in_block: [0.0; 16], farthest: [0.0; 16] };
}

/// Nearer than everything.
const NOWHERE: f32 = 1e30;

/// Draws a body. Returns how many of its faces are seen; nothing, if it must be drawn in another way.
#[inline(always)]
pub(super) fn draw<S: Simd>(
    simd: S,
    surface: &mut Surface,
    (silhouette, placed, room): (&mut Silhouette, &mut Placed, &mut Room),
    drawing: &Drawing,
) -> Option<u64> {
    let &Drawing { body, standing, placing, nearest, .. } = drawing;
    let sight = Sight::new(drawing)?;
    let faces = room.find_front(simd, &body, &sight);
    if !room.find_outline(simd, &body) {
        return None;
    }
    placing.place_points(simd, room.outline.iter().map(|ends| body.vertex[usize::from(ends[0])]), placed);
    let edges = placed.corner.iter().zip(&room.outline).map(
        #[inline(always)]
        |(from, ends)| {
            // Each vertex of a boundary is as often the first of an edge as the last.
            let to = placed.corner[usize::from(room.place[usize::from(ends[1])])];
            let (p, q) = if standing.at.front_sign > 0.0 { (*from, to) } else { (to, *from) };
            [[p[0], p[1]], [q[0], q[1]]]
        },
    );
    if silhouette.set(simd, room.outline.len().next_multiple_of(16), placing.slack, edges) {
        room.see(simd, &body, &sight);
        silhouette.for_each_tile(
            simd,
            surface,
            nearest,
            #[inline(always)]
            |surface, covered| fill(simd, surface, &covered, &room.seen, sight.origin),
        );
    }
    Some(faces)
}

/// The eye and the screen in a body's space, relative to its middle.
struct Sight {
    /// The eye, or the way along which depth grows by 1.
    eye: [f32; 3],
    /// Whether d goes into s, and whether into numerators.
    d_in_s: f32,
    d_in_numerator: f32,
    /// v of the centre of the pixel `origin`, and by how much it changes from column to column, and from row to row.
    v: [[f32; 3]; 3],
    origin: [i32; 2],
    /// The row of W, or of depth, for the numbers of balls; its constant, and how long the row is.
    third: [f32; 3],
    third_constant: f32,
    third_length: f32,
    perspective: bool,
    /// Near distance, times less than 1.
    near: f32,
    /// How far columns and rows may be from `origin`.
    extent: [f32; 2],
    /// Of a pixel and the slack, from the middle.
    half: f32,
    /// No depth is larger.
    size: f32,
    /// What depths are lowered by.
    lower: f32,
    /// What s may be off by.
    s_off: f32,
    numerator_off: f32,
    third_off: f32,
}

/// The transform undone: the eye, v and the row of W or of depth, all in a body's space, in f64.
struct Undone {
    eye: DVec3,
    v: [DVec3; 3],
    third: DVec3,
    /// W or depth of the body's middle.
    constant: f64,
}

impl Undone {
    /// For columns and rows that are no farther than `extent` from `origin`, and for what is no nearer than `nearest`.
    /// `None` where f64 cannot tell well enough.
    #[inline(always)]
    fn new(
        at: &ScreenFromObject,
        middle: DVec3,
        origin: [i32; 2],
        extent: [f64; 2],
        nearest: f32,
    ) -> Option<Undone> {
        let row = |r: &[f64; 4]| DVec3::new(r[0], r[1], r[2]);
        let (x, y, third) = (row(&at.x), row(&at.y), row(if at.perspective { &at.w } else { &at.d }));
        let columns = [y.cross(third), third.cross(x), x.cross(y)];
        let per = 1.0 / x.dot(columns[0]);
        let [a, b, c] = columns.map(|column| column * per);
        let solve = |v: DVec3| a * v.x + b * v.y + c * v.z;
        let off = |p: DVec3, v: DVec3| DVec3::new(x.dot(p), y.dot(p), third.dot(p)) - v;
        let [mx, my, mw, md] = at.point(middle.to_array());
        let [px, py] = origin.map(|px| f64::from(px * 256 + 128));
        let (to_eye, to_pixel) = match at.perspective {
            true => (DVec3::new(-mx, -my, -mw), DVec3::new(px, py, 1.0)),
            false => (DVec3::Z, DVec3::new(px - mx, py - my, -md)),
        };
        let (eye, v) = (solve(to_eye), [solve(to_pixel), a * 256.0, b * 256.0]);
        let (least_w, most) = match at.perspective {
            true => (at.d[3] / f64::from(nearest), GUARD_MAX * 256.0),
            false => (1.0, 1e6),
        };
        // Each moves a point of the image by a sixteenth of 1/256 pixel, and all together a depth by less than 2⁻²⁴ of it.
        let fits = |r: DVec3, scale: f64| r.x.abs() + r.y.abs() + r.z.abs() * most < scale * 0.06;
        let well = fits(off(eye, to_eye), least_w)
            && fits(off(v[0], to_pixel), 1.0)
            && fits(off(v[1], DVec3::X * 256.0) * extent[0], 1.0)
            && fits(off(v[2], DVec3::Y * 256.0) * extent[1], 1.0);
        let (constant, near) = if at.perspective { (mw, at.d[3]) } else { (md, 1.0) };
        well.then(|| Undone { eye, v: v.map(|v| v * near), third, constant })
    }
}

#[inline(always)]
fn sum_of(v: DVec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

impl Sight {
    /// `None` where f64 cannot tell well enough.
    #[inline(always)]
    fn new(drawing: &Drawing) -> Option<Sight> {
        let &Drawing { body, standing, placing, rect, nearest, farthest } = drawing;
        let (round, at) = (body.round, &standing.at);
        let origin = [((rect[0] + rect[2]) >> 1) & !15, ((rect[1] + rect[3]) >> 1) & !15];
        let extent = [0, 1].map(|k| f64::from((rect[k + 2] - origin[k]).max(origin[k] - rect[k]) + 16));
        let Undone { eye, v, third, constant } = Undone::new(at, round.middle, origin, extent, nearest)?;
        let (d_in_s, d_in_numerator) = if at.perspective { (1.0, 0.0) } else { (0.0, 1.0) };
        // A normal is no longer than twice its largest coordinate.
        let eps = f64::from(EPS) * 1.01;
        let [s_d, numerator_d] = [d_in_s, d_in_numerator].map(|factor| f64::from(factor) * 2.0 * round.reach);
        let numerators = sum_of(v[0]) + extent[0] * sum_of(v[1]) + extent[1] * sum_of(v[2]) + numerator_d;
        let size = nearest.abs().max(farthest.abs());
        let lost = (1.0 - placing.shrink + 2f64.powi(-22)) as f32 * 1.01;
        Some(Sight {
            eye: eye.as_vec3().to_array(),
            d_in_s,
            d_in_numerator,
            v: v.map(|v| v.as_vec3().to_array()),
            origin,
            third: (third * round.unit).as_vec3().to_array(),
            third_constant: (constant + third.dot(round.low)) as f32,
            third_length: (third.length() * round.unit) as f32,
            perspective: at.perspective,
            near: (at.d[3] * placing.shrink) as f32,
            extent: extent.map(|e| e as f32),
            half: 0.5 + (placing.slack + 1) as f32 / 256.0,
            size,
            lower: size * lost + if at.perspective { 0.0 } else { 2.5e-6 },
            s_off: (eps * NORMAL * (sum_of(eye) + s_d)) as f32,
            numerator_off: (eps * NORMAL * numerators) as f32,
            third_off: (eps * (sum_of(third) * 4.0 * round.reach + constant.abs())) as f32,
        })
    }
}

#[inline(always)]
fn dot<S: Simd>(n: &[f32x16<S>; 3], v: &[f32; 3]) -> f32x16<S> {
    n[0] * v[0] + n[1] * v[1] + n[2] * v[2]
}

impl Room {
    /// Finds the faces that turn to the eye. Returns how many there are.
    #[inline(always)]
    fn find_front<S: Simd>(&mut self, simd: S, body: &RoundBody, sight: &Sight) -> u64 {
        self.front.clear();
        let mut count = 0;
        for sixteen in body.sixteen {
            let d = f32x16::from_slice(simd, &sixteen.d);
            let front = sight.s(&sixteen.normal(simd), d).simd_gt(0.0).to_bitmask() as u16;
            count += front.count_ones();
            self.front.push(front);
        }
        u64::from(count)
    }

    /// Finds the edges that have such a face on one side only. False if there are none, or too many.
    #[inline(always)]
    fn find_outline<S: Simd>(&mut self, simd: S, body: &RoundBody) -> bool {
        self.place.resize(self.place.len().max(body.vertex.len()), 0);
        self.outline.clear();
        let (four, one) = (i32x16::splat(simd, 15), i32x16::splat(simd, 1));
        let mut edges = body.edge;
        for pair in body.pair {
            let (these, rest) = edges.split_at(usize::from(pair.edges));
            let [left, right] = pair.sixteens;
            let (left, right) = (self.front[usize::from(left)], self.front[usize::from(right)]);
            let all = edges;
            edges = rest;
            if left == right && (left == 0 || left == 0xFFFF) {
                continue;
            }
            let (left, right) = (i32x16::splat(simd, left.into()), i32x16::splat(simd, right.into()));
            for first in (0..these.len()).step_by(16) {
                let sixteen = i32x16::from_slice(simd, &all[first..][..16]);
                let is_left = simd.shrv_i32x16(left, sixteen & four) & one;
                let is_right = simd.shrv_i32x16(right, (sixteen >> 4) & four) & one;
                let mut hits = is_left.simd_gt(is_right).to_bitmask() as u32;
                let reversed = is_left.simd_lt(is_right).to_bitmask() as u32;
                hits = (hits | reversed) & !(0xFFFF_FFFF << (these.len() - first).min(16));
                while hits != 0 {
                    let lane = hits.trailing_zeros() as usize;
                    hits &= hits - 1;
                    let edge = all[first + lane].cast_unsigned();
                    let (a, b) = ((edge >> 8 & 4095) as u16, (edge >> 20) as u16);
                    let ends = if reversed >> lane & 1 == 1 { [b, a] } else { [a, b] };
                    self.place[usize::from(ends[0])] = self.outline.len() as u16;
                    self.outline.push(ends);
                }
            }
        }
        (1..=MOST_EDGES).contains(&self.outline.len())
    }

    /// Finds the planes of the faces that turn to the eye.
    #[inline(always)]
    fn see<S: Simd>(&mut self, simd: S, body: &RoundBody, sight: &Sight) {
        let mut count = 0;
        self.seen.resize(body.sixteen.len(), SixteenSeen::NONE);
        for (sixteen, &front) in body.sixteen.iter().zip(&self.front) {
            if front != 0 {
                sight.see(simd, sixteen, front, &mut self.seen[count]);
                count += 1;
            }
        }
        self.seen.truncate(count);
    }
}

impl Sight {
    /// More than 0 where the eye is before a plane.
    #[inline(always)]
    fn s<S: Simd>(&self, n: &[f32x16<S>; 3], d: f32x16<S>) -> f32x16<S> {
        dot(n, &self.eye) - d * self.d_in_s
    }

    #[inline(always)]
    fn see<S: Simd>(&self, simd: S, faces: &SixteenFaces, front: u16, seen: &mut SixteenSeen) {
        let (n, d) = (faces.normal(simd), f32x16::from_slice(simd, &faces.d));
        let s = self.s(&n, d);
        let counts = s.simd_ge(self.s_off * 8.0);
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let per = one / counts.select(s, one);
        let a = counts.select((zero - dot(&n, &self.v[1])) * per, zero);
        let b = counts.select((zero - dot(&n, &self.v[2])) * per, zero);
        let c = (d * self.d_in_numerator - dot(&n, &self.v[0])) * per;
        let (across, down) = (a.abs(), b.abs());
        let fall = (across + down) * self.half;
        let rounding = (across * self.extent[0] + down * self.extent[1] + c.abs()) * (2.0 * EPS);
        let off = per * (self.numerator_off * 1.25 + self.size * self.s_off * 2.5);
        let c = counts.select(c - (fall + rounding + off + self.lower), zero - NOWHERE);
        let in_block = c + (a * 3.0).min(0.0) + (b * 3.0).min(0.0);
        let farthest = self.farthest(simd, faces);
        let nowhere = f32x16::splat(simd, NOWHERE);
        let front = mask32x16::from_bitmask(simd, u64::from(front));
        front.select(a, zero).store_slice(&mut seen.a);
        front.select(b, zero).store_slice(&mut seen.b);
        front.select(c, nowhere).store_slice(&mut seen.c);
        front.select(in_block, nowhere).store_slice(&mut seen.in_block);
        front.select(farthest, nowhere).store_slice(&mut seen.farthest);
    }

    /// Depths of the farthest points of the balls around faces.
    #[inline(always)]
    fn farthest<S: Simd>(&self, simd: S, faces: &SixteenFaces) -> f32x16<S> {
        let [x, y, z, radius] = faces.ball(simd);
        let radius = radius * (self.third_length * (1.0 + EPS));
        let third = dot(&[x, y, z], &self.third) + self.third_constant;
        if self.perspective {
            let most = (third + radius + self.third_off) * (1.0 + 2.0 * EPS);
            f32x16::splat(simd, self.near * (1.0 - 2.0 * EPS)) / most
        } else {
            third - radius * (1.0 + 2.0 * EPS) - (self.third_off + self.lower)
        }
    }
}

/// Fills what is covered of a tile.
#[inline(always)]
fn fill<S: Simd>(
    simd: S,
    surface: &mut Surface,
    covered: &InTile<S>,
    seen: &[SixteenSeen],
    origin: [i32; 2],
) {
    let [x, y] = covered.at;
    let tile = surface.tile(x >> 4, y >> 4);
    let from = [(x - origin[0]) as f32, (y + surface.top - origin[1]) as f32];
    let highest = highest(simd, seen, from);
    surface.refresh_tile(simd, tile);
    if !surface.may_gain(simd, tile, covered.inner, highest) {
        return;
    }
    let over = over_tile(simd, seen, from, highest);
    if over.count > FEW {
        surface.raise_covered(simd, tile, &columns(covered), over.least, highest);
        return;
    }
    let planes = few_planes(seen, &over.which[..over.count], from);
    covered.raise(simd, surface, &planes[..over.count], highest);
}

/// The columns of each row that are covered.
#[inline(always)]
fn columns<S: Simd>(covered: &InTile<S>) -> [u16; 16] {
    let [from, to] = covered.spans;
    let from: [f32; 16] = from.max(0.0).min(16.0).into();
    let end: [f32; 16] = (to + 1.0).max(0.0).min(16.0).into();
    let mut columns = [0; 16];
    for ((columns, from), end) in columns.iter_mut().zip(from).zip(end) {
        *columns = (0xFFFFu32 << from as i32 & !(0xFFFF_FFFFu32 << end as i32)) as u16;
    }
    columns
}

/// Half a tile, from its middle: of the centres of its pixels.
const HALF: f32 = 7.5;

/// At no point of the tile that begins there the least of all is nearer.
#[inline(always)]
fn highest<S: Simd>(simd: S, seen: &[SixteenSeen], from: [f32; 2]) -> f32 {
    let mut highest = f32x16::splat(simd, NOWHERE);
    for sixteen in seen {
        let [middle, half, farthest] = sixteen.in_tile(simd, from);
        highest = highest.min((middle + half).max(farthest));
    }
    highest.reduce_min()
}

/// A tile of no more planes than these holds a depth for each pixel.
const FEW: usize = 4;

/// What is the least somewhere in a tile.
struct OverTile<S: Simd> {
    /// In each block.
    least: f32x16<S>,
    /// How many faces are, and which, if they are few: sixteen times the place of theirs, and the lane.
    count: usize,
    which: [usize; FEW],
}

/// What is the least of all somewhere in the tile that begins there: no face that is nearer than `highest` everywhere.
#[inline(always)]
fn over_tile<S: Simd>(simd: S, seen: &[SixteenSeen], from: [f32; 2], highest: f32) -> OverTile<S> {
    let (x, y) =
        (f32x16::from_slice(simd, &BLOCK_COLUMNS) + from[0], f32x16::from_slice(simd, &BLOCK_ROWS) + from[1]);
    let mut over = OverTile { least: f32x16::splat(simd, highest), count: 0, which: [0; FEW] };
    for (at, sixteen) in seen.iter().enumerate() {
        let [middle, half, farthest] = sixteen.in_tile(simd, from);
        let mut rest = (middle - half).max(farthest).simd_le(highest).to_bitmask() as u32;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize & 15;
            rest &= rest - 1;
            let depth = x * sixteen.a[lane] + (y * sixteen.b[lane] + sixteen.in_block[lane]);
            over.least = over.least.min(depth.max(sixteen.farthest[lane]));
            over.which[over.count % FEW] = at * 16 + lane;
            over.count += 1;
        }
    }
    over
}

/// The planes of a few faces over the tile that begins there, and what they count no less than.
#[inline(always)]
fn few_planes(seen: &[SixteenSeen], which: &[usize], from: [f32; 2]) -> [(TilePlane, f32); FEW] {
    let mut planes = [(TilePlane::ZERO, 0.0); FEW];
    for (to, which) in planes.iter_mut().zip(which) {
        let (sixteen, lane) = (&seen[which / 16], which % 16);
        let (a, b) = (sixteen.a[lane], sixteen.b[lane]);
        let origin = sixteen.c[lane] + (from[0] * a + from[1] * b);
        *to = (TilePlane { origin, per_column: a, per_row: b }, sixteen.farthest[lane]);
    }
    planes
}

impl SixteenSeen {
    /// Over the tile that begins there: planes in its middle, what they rise and fall from there to its ends, and what they
    /// count no less than.
    #[inline(always)]
    fn in_tile<S: Simd>(&self, simd: S, [x, y]: [f32; 2]) -> [f32x16<S>; 3] {
        let (a, b) = (f32x16::from_slice(simd, &self.a), f32x16::from_slice(simd, &self.b));
        let c = f32x16::from_slice(simd, &self.c);
        let middle = a * (x + HALF) + (b * (y + HALF) + c);
        [middle, (a.abs() + b.abs()) * HALF, f32x16::from_slice(simd, &self.farthest)]
    }
}
