//! Extents of hulls on the six faces of a cube around the eye, and a grid on each face to find what overlaps.
//!
//! Extents are those of [Snyder & Lengyel 1997, §5]: one spatial direction, the depth along the face's axis,
//! and four angular ones, as tangents: across, up, and both diagonals of the face. They are those of a simpler body
//! around a hull: the ellipsoid along its own axes, whose tangents are the roots of quadratics, or the box, whose eight
//! corners are projected side by side; whichever is smaller. That takes a tenth of the time of ten climbs on the hull
//! from the last frame's vertices. What is let through costs an exact test: over 102,400 toothpicks the hulls would let
//! 0.33 a part through, their ellipsoids 0.38, their boxes 0.50.
//! Where they measure angles around two axes and give up at the branch cut behind the eye, a cube has no
//! branch cut: a hull that reaches over an edge of the cube has an extent on both faces. The axes are the
//! world's, so that turning the head changes nothing; only where the eye is counts.
//!
//! Instead of a kd-tree that is rebalanced from frame to frame (§5.2) each face has a grid whose cells list the extents over them by their nearest depth. It is made anew each frame in linear time. What is
//! already in the output is skipped, and for good at a list's beginning: the query of an extent looks at what
//! remains between its back and the eye, which is next to nothing if last frame's order still holds.

use crate::geometry::Hull;
use glam::{DAffine3, DMat3, DVec3};

/// No record.
pub(super) const NONE: u32 = u32::MAX;

/// What a piece covers on a face. Rounded outwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    /// Least and greatest x/z, least and greatest y/z, in [−1, 1].
    rect: [f32; 4],
    /// Least and greatest (x+y)/z, least and greatest (x−y)/z.
    diagonal: [f32; 4],
    /// Least depth along the face's axis; 0 where the hull reaches behind the eye.
    near: f32,
    /// Greatest depth.
    far: f32,
    /// Whose extent this is.
    pub(super) piece: u32,
    /// The same piece's record on another face.
    pub(super) next: u32,
}

impl Record {
    /// Whether the extents of both meet where `self` is not behind all of `behind`.
    #[inline]
    pub(super) fn may_occlude(&self, behind: &Record) -> bool {
        self.near <= behind.far && meet(&self.rect, &behind.rect) && meet(&self.diagonal, &behind.diagonal)
    }
}

#[inline]
fn meet(a: &[f32; 4], b: &[f32; 4]) -> bool {
    (a[0] <= b[1]) & (b[0] <= a[1]) & (a[2] <= b[3]) & (b[2] <= a[3])
}

/// Tangents are single precision: a few units in the last place of 1.
const PAD: f64 = 5e-7;
/// Depths are too, relatively.
const DEPTH_PAD: f64 = 1e-6;
/// The largest roundness with which an ellipsoid is smaller than its box: (6 / π)^⅓.
const ROUND: f64 = 1.24;
/// An ellipsoid whose nearest depth is below this share of its farthest is measured as a box: its tangents are roots
/// that nearly cancel. Above, they are right to 10⁻⁷, a fifth of the padding.
const STEEP: f64 = 0.05;
/// A hull whose nearest depth is below this share of its farthest has no tangents that mean anything.
const GRAZING: f64 = 1e-6;

/// A face of the cube: its axes and the signs, as numbers from 0 to 5.
fn axes(face: usize) -> (usize, f64) {
    (face % 3, if face < 3 { 1.0 } else { -1.0 })
}

/// Whether a sphere around `center` (eye at the origin) may reach into the pyramid over `face`.
#[inline]
fn sphere_reaches(center: DVec3, radius: f64, face: usize) -> bool {
    let (k, sign) = axes(face);
    let c = center.to_array();
    let z = sign * c[k];
    let aside = c[(k + 1) % 3].abs().max(c[(k + 2) % 3].abs());
    z > -radius && aside - z <= radius * std::f64::consts::SQRT_2
}

/// The extents of one frame, sorted by their nearest depth, and the grids over them.
#[derive(Debug, Default)]
pub(super) struct Faces {
    pub(super) records: Vec<Record>,
    faces: Vec<u8>,
    /// A piece's first record.
    pub(super) first: Vec<u32>,
    unsorted: Vec<(Record, u8)>,
    keys: Vec<(u32, u32)>,
    spare: Vec<(u32, u32)>,
    /// Cells a side.
    side: usize,
    /// Where each cell's list begins; one more at the end.
    starts: Vec<u32>,
    /// Where each cell's list begins now that pieces are taken out.
    heads: Vec<u32>,
    /// In each cell by nearest depth.
    lists: Vec<Entry>,
    /// For each record whether its piece is taken out.
    gone: Vec<bool>,
}

/// A record in a cell's list, with what ends most searches.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    near: f32,
    record: u32,
}

impl Faces {
    /// Forgets the last frame; `pieces` is how many there are.
    pub(super) fn clear(&mut self, pieces: usize) {
        self.unsorted.clear();
        self.first.clear();
        self.first.resize(pieces, NONE);
    }

    /// Adds a piece, whose pose is relative to the eye. `slack` widens it, radians and share of depth.
    pub(super) fn add(&mut self, piece: u32, hull: &Hull, pose: &DAffine3, sphere: (DVec3, f64), slack: f64) {
        let half = DMat3::from_diagonal(hull.bounds().size() * 0.5);
        let body = Body {
            center: sphere.0,
            rows: (pose.matrix3 * half).transpose(),
            roundness: Some(hull.roundness()).filter(|&r| r < ROUND),
        };
        for face in 0..6 {
            if !sphere_reaches(sphere.0, sphere.1 * (1.0 + PAD), face) {
                continue;
            }
            if let Some(mut record) = body.extent(face, slack) {
                record.piece = piece;
                self.unsorted.push((record, face as u8));
            }
        }
    }

    /// Sorts what was added and fills the grids; without `grids` each face is a single cell.
    pub(super) fn build(&mut self, grids: bool) {
        self.sort();
        self.side = 1;
        if grids {
            self.choose_side();
        }
        let cells = 6 * self.side * self.side;
        self.starts.clear();
        self.starts.resize(cells + 1, 0);
        for (record, &face) in self.records.iter().zip(&self.faces) {
            for_cells(self.side, record, face, |cell| self.starts[cell + 1] += 1);
        }
        for cell in 0..cells {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.lists.clear();
        self.lists.resize(self.starts[cells] as usize, Entry::default());
        self.heads.clear();
        self.heads.extend_from_slice(&self.starts[..cells]);
        for (at, (record, &face)) in self.records.iter().zip(&self.faces).enumerate() {
            for_cells(self.side, record, face, |cell| {
                let entry = Entry { near: record.near, record: at as u32 };
                self.lists[self.heads[cell] as usize] = entry;
                self.heads[cell] += 1;
            });
        }
        self.restore();
    }

    /// Makes every piece findable again.
    pub(super) fn restore(&mut self) {
        let cells = self.heads.len();
        self.heads.copy_from_slice(&self.starts[..cells]);
        self.gone.clear();
        self.gone.resize(self.records.len(), false);
    }

    /// Takes a piece out: it is found no more.
    #[inline]
    pub(super) fn take_out(&mut self, piece: u32) {
        let mut at = self.first[piece as usize];
        while at != NONE {
            self.gone[at as usize] = true;
            at = self.records[at as usize].next;
        }
    }

    fn sort(&mut self) {
        self.keys.clear();
        // A depth is never negative, so its bits sort as it does.
        self.keys.extend(self.unsorted.iter().enumerate().map(|(at, (r, _))| (r.near.to_bits(), at as u32)));
        radix_sort(&mut self.keys, &mut self.spare);
        self.records.clear();
        self.faces.clear();
        for &(_, at) in &self.keys {
            let (mut record, face) = self.unsorted[at as usize];
            let first = &mut self.first[record.piece as usize];
            record.next = std::mem::replace(first, self.records.len() as u32);
            self.records.push(record);
            self.faces.push(face);
        }
    }

    /// As fine as it can be with no more than a few cells to a record on average.
    fn choose_side(&mut self) {
        const CELLS_A_RECORD: f64 = 4.0;
        let (mut sides, mut areas) = (0.0, 0.0);
        for r in &self.records {
            let (w, h) = (f64::from(r.rect[1] - r.rect[0]), f64::from(r.rect[3] - r.rect[2]));
            sides += w + h;
            areas += w * h;
        }
        let n = self.records.len() as f64;
        let cells = |side: f64| n + sides * side * 0.5 + areas * side * side * 0.25;
        let mut side = 1.0;
        while side < 512.0 && cells(side * 1.5) <= CELLS_A_RECORD * n && 6.0 * side * side * 2.25 <= 4.0 * n {
            side *= 1.5;
        }
        self.side = side as usize;
    }

    /// Calls `found` with the piece of every record that may occlude part of `piece`, among the pieces that are not
    /// taken out nor `piece` itself. A piece on several faces can be found repeatedly.
    #[inline]
    pub(super) fn occluders(&mut self, piece: u32, mut found: impl FnMut(u32)) {
        let mut at = self.first[piece as usize];
        while at != NONE {
            let record = self.records[at as usize];
            let face = self.faces[at as usize];
            self.occluders_of_record(&record, face, &mut found);
            at = record.next;
        }
    }

    #[inline]
    fn occluders_of_record(&mut self, behind: &Record, face: u8, found: &mut impl FnMut(u32)) {
        let side = self.side;
        let [x0, x1, y0, y1] = cell_range(side, behind);
        for y in y0..=y1 {
            for x in x0..=x1 {
                let cell = (usize::from(face) * side + y) * side + x;
                let list = &self.lists[self.heads[cell] as usize..self.starts[cell + 1] as usize];
                let out = list.iter().take_while(|e| self.gone[e.record as usize]).count();
                self.heads[cell] += out as u32;
                for entry in &list[out..] {
                    if entry.near > behind.far {
                        break;
                    }
                    if self.gone[entry.record as usize] {
                        continue;
                    }
                    let front = &self.records[entry.record as usize];
                    if !front.may_occlude(behind) || front.piece == behind.piece {
                        continue;
                    }
                    // Both lie over several cells, perhaps; only the first of these counts.
                    let [fx, _, fy, _] = cell_range(side, front);
                    if fx.max(x0) == x && fy.max(y0) == y {
                        found(front.piece);
                    }
                }
            }
        }
    }

    /// Whether the extents allow that `front` occludes part of `behind`.
    pub(super) fn may_occlude(&self, front: u32, behind: u32) -> bool {
        let mut f = self.first[front as usize];
        while f != NONE {
            let record = &self.records[f as usize];
            let mut b = self.first[behind as usize];
            while b != NONE {
                let other = &self.records[b as usize];
                if self.faces[f as usize] == self.faces[b as usize] && record.may_occlude(other) {
                    return true;
                }
                b = other.next;
            }
            f = record.next;
        }
        false
    }

    /// Cells in all grids, and entries in their lists.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.heads.len(), self.lists.len())
    }
}

/// First and last column, first and last row.
#[inline]
fn cell_range(side: usize, record: &Record) -> [usize; 4] {
    let half = side as f32 * 0.5;
    // A cast saturates at zero.
    record.rect.map(|t| (((t + 1.0) * half) as usize).min(side - 1))
}

#[inline]
fn for_cells(side: usize, record: &Record, face: u8, mut each: impl FnMut(usize)) {
    let [x0, x1, y0, y1] = cell_range(side, record);
    for y in y0..=y1 {
        for x in x0..=x1 {
            each((usize::from(face) * side + y) * side + x);
        }
    }
}

/// A box, or an ellipsoid along its axes, as the eye sees it.
struct Body {
    center: DVec3,
    /// For each coordinate what the box's three half sides have of it.
    rows: DMat3,
    /// The ellipsoid's semiaxes are so many half sides; none if the box is smaller.
    roundness: Option<f64>,
}

/// A coordinate, or a sum of coordinates: of the centre, and of the three half sides.
type Along = (f64, DVec3);

impl Body {
    /// The extent on a face; `None` if it is not over the face.
    #[inline]
    fn extent(&self, face: usize, slack: f64) -> Option<Record> {
        let (k, sign) = axes(face);
        let along = |i: usize| (self.center[i % 3], self.rows.col(i % 3));
        let (x, y) = (along(k + 1), along(k + 2));
        let z = (along(k).0 * sign, along(k).1 * sign);
        let reach = z.1.abs().element_sum();
        let (mut near, mut far) = (z.0 - reach, z.0 + reach);
        let mut ellipsoid = None;
        if let Some(roundness) = self.roundness {
            let reach = z.1.length() * roundness;
            if z.0 - reach > (z.0 + reach) * STEEP {
                (near, far) = (z.0 - reach, z.0 + reach);
                ellipsoid = Some(roundness * roundness);
            }
        }
        if far <= 0.0 {
            return None;
        }
        let mut record = Record {
            rect: [-1.0, 1.0, -1.0, 1.0],
            diagonal: [-2.0, 2.0, -2.0, 2.0],
            near: (near * (1.0 - DEPTH_PAD - slack)).max(0.0) as f32,
            far: (far * (1.0 + DEPTH_PAD + slack)) as f32,
            piece: NONE,
            next: NONE,
        };
        if near <= far * GRAZING {
            return Some(record);
        }
        let (low, high) = match ellipsoid {
            Some(square) => of_ellipsoid(x, y, z, square),
            None => of_box(x, y, z),
        };
        let pad = PAD + 3.0 * slack;
        if low[0] - pad > 1.0 || high[0] + pad < -1.0 || low[1] - pad > 1.0 || high[1] + pad < -1.0 {
            return None;
        }
        let ends = |i: usize, pad: f64| [(low[i] - pad) as f32, (high[i] + pad) as f32];
        let ([u0, u1], [v0, v1]) = (ends(0, pad), ends(1, pad));
        let ([s0, s1], [d0, d1]) = (ends(2, 2.0 * pad), ends(3, 2.0 * pad));
        record.rect = [u0, u1, v0, v1].map(|t| t.clamp(-1.0, 1.0));
        record.diagonal = [s0, s1, d0, d1];
        Some(record)
    }
}

/// Least and greatest x/z, y/z, (x+y)/z and (x−y)/z of a box.
#[inline]
fn of_box(x: Along, y: Along, z: Along) -> ([f64; 4], [f64; 4]) {
    let (x, y, z) = (corners(x), corners(y), corners(z));
    let mut tangents = [[0.0; 8]; 4];
    for i in 0..8 {
        let scale = 1.0 / z[i];
        let (u, v) = (x[i] * scale, y[i] * scale);
        (tangents[0][i], tangents[1][i]) = (u, v);
        (tangents[2][i], tangents[3][i]) = (u + v, u - v);
    }
    let (mut low, mut high) = ([0.0; 4], [0.0; 4]);
    for i in 0..4 {
        (low[i], high[i]) = range(&tangents[i]);
    }
    (low, high)
}

/// The same of an ellipsoid whose semiaxes are the root of `square` times the half sides: a plane x = u z touches it
/// where its centre's height over the plane is the length of what the semiaxes have of that,
/// (x − u z)² = |X − u Z|², a quadratic in u.
#[inline]
fn of_ellipsoid(x: Along, y: Along, z: Along, square: f64) -> ([f64; 4], [f64; 4]) {
    let xy = 2.0 * x.1.dot(y.1);
    let (xx, yy) = (x.1.length_squared(), y.1.length_squared());
    let (xz, yz) = (x.1.dot(z.1), y.1.dot(z.1));
    let lengths = [xx, yy, xx + yy + xy, xx + yy - xy];
    let with_z = [xz, yz, xz + yz, xz - yz];
    let centers = [x.0, y.0, x.0 + y.0, x.0 - y.0];
    let a = z.0 * z.0 - square * z.1.length_squared();
    let scale = 1.0 / a;
    let (mut low, mut high) = ([0.0; 4], [0.0; 4]);
    for i in 0..4 {
        let b = centers[i] * z.0 - square * with_z[i];
        let c = centers[i] * centers[i] - square * lengths[i];
        let root = (b * b - a * c).max(0.0).sqrt();
        (low[i], high[i]) = ((b - root) * scale, (b + root) * scale);
    }
    (low, high)
}

/// A coordinate at the eight corners of a box.
#[inline]
fn corners((center, half): (f64, DVec3)) -> [f64; 8] {
    let [a, b, c] = half.to_array();
    let (low, high) = (center - c, center + c);
    let (p, q) = (a + b, a - b);
    [low - p, low + q, low - q, low + p, high - p, high + q, high - q, high + p]
}

#[inline]
fn range(values: &[f64; 8]) -> (f64, f64) {
    let (mut least, mut greatest) = (values[0], values[0]);
    for &value in &values[1..] {
        least = if value < least { value } else { least };
        greatest = if value > greatest { value } else { greatest };
    }
    (least, greatest)
}

/// Sorts by the first number, stably, in linear time: three passes of eleven bits, those that all share left out.
fn radix_sort(keys: &mut Vec<(u32, u32)>, spare: &mut Vec<(u32, u32)>) {
    const BITS: u32 = 11;
    spare.clear();
    spare.resize(keys.len(), (0, 0));
    for shift in [0, BITS, 2 * BITS] {
        let digit = |key: u32| (key >> shift) as usize & ((1 << BITS) - 1);
        let mut places = [0u32; 1 << BITS];
        for &(key, _) in keys.iter() {
            places[digit(key)] += 1;
        }
        let mut sum = 0;
        for place in &mut places {
            sum += std::mem::replace(place, sum);
        }
        for &entry in keys.iter() {
            let place = &mut places[digit(entry.0)];
            spare[*place as usize] = entry;
            *place += 1;
        }
        std::mem::swap(keys, spare);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]
        /// Every vertex lies in the extent on its face, whatever the hull is measured as.
        #[test]
        fn extents_hold_every_vertex(
            size in prop::array::uniform3(prop::sample::select(vec![1e-6, 1e-3, 0.05, 1.0, 30.0])),
            center in prop::array::uniform3(-2.0..2.0f64),
            away in prop::sample::select(vec![0.3, 1.0, 20.0, 1e4]),
            turn in prop::array::uniform4(-1.0..1.0f64), round: bool,
        ) {
            let points: Vec<DVec3> = (0..60).map(|i| {
                let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / 60.0;
                let (s, c) = (f64::from(i) * 2.399_963).sin_cos();
                let p = DVec3::new(c * (1.0 - z * z).sqrt(), s * (1.0 - z * z).sqrt(), z);
                (if round { p } else { p.signum() * 0.9 + p * 0.1 }) * DVec3::from(size)
            }).collect();
            let hull = Hull::around(&points).unwrap();
            prop_assert_eq!(round, hull.roundness() < ROUND);
            let turn = glam::DVec4::from(turn).try_normalize().map_or(glam::DQuat::IDENTITY, glam::DQuat::from_vec4);
            let pose = DAffine3::from_rotation_translation(turn, DVec3::from(center) * away);
            let mut faces = Faces::default();
            faces.clear(1);
            faces.add(0, &hull, &pose, (pose.transform_point3(hull.center()), hull.radius()), 0.0);
            for &vertex in hull.vertices() {
                let p = pose.transform_point3(vertex).to_array();
                let k = (0..3).max_by(|&i, &j| p[i].abs().total_cmp(&p[j].abs())).unwrap();
                let face = if p[k] > 0.0 { k } else { k + 3 };
                let (u, v, z) = (p[(k + 1) % 3] / p[k].abs(), p[(k + 2) % 3] / p[k].abs(), p[k].abs() as f32);
                let found = faces.unsorted.iter().find(|(_, f)| usize::from(*f) == face);
                let Some((r, _)) = found else { return Err(TestCaseError::fail(format!("not on face {face}"))) };
                let holds = |low: f32, high: f32, t: f64| f64::from(low) <= t && t <= f64::from(high);
                prop_assert!(r.near <= z && z <= r.far, "{r:?} {z}");
                prop_assert!(holds(r.rect[0], r.rect[1], u) && holds(r.rect[2], r.rect[3], v), "{r:?} {u} {v}");
                prop_assert!(holds(r.diagonal[0], r.diagonal[1], u + v), "{r:?} {u} {v}");
                prop_assert!(holds(r.diagonal[2], r.diagonal[3], u - v), "{r:?} {u} {v}");
            }
        }

        #[test]
        fn radix_sorts(values in prop::collection::vec(any::<u32>(), 0..500)) {
            let mut keys: Vec<(u32, u32)> = values.iter().copied().zip(0..).collect();
            let mut expected = keys.clone();
            expected.sort();
            radix_sort(&mut keys, &mut Vec::new());
            prop_assert_eq!(keys, expected);
        }
    }
}
