//! Crowds of triangles in one plane, of which no two meet in a line.
//!
//! In a fan, a comb or a wall of slivers the boxes of all overlap: tried pair by pair they would take the square of
//! their number, only to be found to lie in one plane. Here that is found once. A *flat* is a set of triangles of
//! which every two would be rejected because the one lies in the other's plane, by the very arithmetic of
//! [`intersections`](super::intersections); so leaving such pairs out changes no drawing. Only where cells are
//! crowded are flats looked for, so that ordinary meshes pay nothing. Triangles that could be in a flat may be left
//! out of it: they are tried pair by pair.
//!
//! Why every two: let N and P be a unit normal and a point of some plane near all of them, and c a corner of
//! triangle b. For triangle a with normal n through p,
//!
//! > |n·(c − p)| ≤ |N·(c − P)| + |N·(p − P)| + |n ∓ N| |c − p|
//!
//! The last is at most the *tilt* of a, |n ∓ N| times the size of the crowd; the others are at most the *rise* of b
//! and of a, the greatest |N·(c − P)| of their corners. With *noise* = 2 (rise + tilt + rounding) the sum is at most
//! the greater of both noises. What counts as in the plane is at least the tolerance at c. So a set of triangles is a
//! flat if no noise among them is greater than any tolerance: if the intervals from noise to tolerance have a common
//! point.

use super::intersections::Plane;
use super::occluders::Occluders;
use super::shown::Shown;
use super::topology::NONE;
use glam::DVec3;

/// Cells with more triangles than this are crowded. A mesh of even triangles has some two a cell and layer.
const CROWD: usize = 64;

/// Fewer triangles than this are not worth being a flat.
const FEW: usize = 16;

/// How many flats are looked for among triangles of about the same plane.
const ROUNDS: usize = 4;

/// Normals that differ by less are about the same, but where they are told apart by rounding.
const ABOUT: f64 = 1e-5;

/// Distances of planes that differ by less than so many tolerances are about the same.
const LAYER: f64 = 16.0;

/// A unit vector that nothing is at right angles to on purpose.
const AWRY: DVec3 = DVec3::new(0.577_812, 0.311_423, 0.754_433);

/// The part of a coordinate in view space that is rounding of one distance to a plane.
const ROUNDING: f64 = 4e-15;

/// Which flat each triangle of a list is in.
pub(super) struct Flats {
    /// A number or [`NONE`]; empty where there are no flats.
    of: Vec<u32>,
}

impl Flats {
    /// Finds the flats among the crowded triangles, whose planes are given. Cost: those, sorted.
    pub fn find(shown: &Shown, surfaces: &Occluders, planes: &[Plane]) -> Flats {
        let mut of = Vec::new();
        let mut count = 0;
        let crowd = Crowd { shown, surfaces, planes };
        for mut bundle in crowd.bundles() {
            for _ in 0..ROUNDS {
                let flat = if bundle.len() < FEW { Vec::new() } else { crowd.take_flat(&mut bundle) };
                if flat.len() < FEW {
                    break;
                }
                of.resize(surfaces.list.len(), NONE);
                flat.iter().for_each(|&i| of[i as usize] = count);
                count += 1;
            }
        }
        Flats { of }
    }

    /// Whether two triangles are in one flat.
    #[inline]
    pub fn share(&self, a: u32, b: u32) -> bool {
        !self.of.is_empty() && self.of[a as usize] != NONE && self.of[a as usize] == self.of[b as usize]
    }

    /// For each place in a list of triangles the next one whose triangle is not in the same flat.
    pub fn skips(&self, list: &[u32], skips: &mut Vec<usize>) {
        skips.clear();
        if self.of.is_empty() {
            return;
        }
        skips.extend(1..=list.len());
        for at in (1..list.len()).rev() {
            if self.share(list[at - 1], list[at]) {
                skips[at - 1] = skips[at];
            }
        }
    }
}

/// Where flats are looked for. Triangles are places in the list of `surfaces`.
struct Crowd<'a> {
    shown: &'a Shown<'a>,
    surfaces: &'a Occluders,
    planes: &'a [Plane],
}

/// A triangle that may be part of a flat.
struct Member {
    place: u32,
    noise: f64,
    /// The least at a corner but one.
    tolerance: f64,
    /// That corner's: a fan around the origin of the world has one where nothing is rounded.
    least: f64,
    corner: u32,
}

impl Crowd<'_> {
    fn triangle(&self, place: u32) -> u32 {
        self.surfaces.list[place as usize].triangle
    }

    /// Triangles of crowded cells, those of about the same plane together. Noise may part some that belong together.
    fn bundles(&self) -> Vec<Vec<u32>> {
        let cells = (0..self.surfaces.grid.len()).map(|cell| self.surfaces.in_cell(cell));
        let mut crowded = Vec::new();
        for list in cells.filter(|list| list.len() > CROWD) {
            crowded.resize(self.planes.len(), false);
            list.iter().for_each(|&i| crowded[i as usize] = true);
        }
        let mut places: Vec<u32> = (0..crowded.len() as u32).filter(|&i| crowded[i as usize]).collect();
        let Some(&first) = places.first() else { return Vec::new() };
        let origin = self.shown.corners_in_view(self.triangle(first))[0];
        let layer = self.shown.lens.tolerance * LAYER;
        let key = |&place: &u32| {
            let plane = &self.planes[place as usize];
            let turn = plane.normal.dot(AWRY).signum();
            let n = plane.normal * (turn / ABOUT);
            // Shifted, so that a round number is not where one step ends.
            [n.x, n.y, n.z, plane.side(origin) * turn / layer].map(|x| (x + 0.3719).floor() as i64)
        };
        places.sort_by_cached_key(key);
        places.chunk_by(|a, b| key(a) == key(b)).map(<[u32]>::to_vec).collect()
    }

    /// Takes a flat out of triangles of about the same plane.
    fn take_flat(&self, bundle: &mut Vec<u32>) -> Vec<u32> {
        let mut members = self.members(bundle);
        let level = most_common(&members);
        members.retain(|m| m.noise <= level && m.tolerance >= level);
        let weak = |m: &Member| m.least < level;
        // Corners that the level is too much for: many triangles may have the same, and must be tried against it.
        let mut corners: Vec<u32> = members.iter().filter(|m| weak(m)).map(|m| m.corner).collect();
        corners.sort_unstable();
        let most = corners.chunk_by(|a, b| a == b).max_by_key(|same| same.len());
        let hub = most.filter(|same| same.len() * 2 > members.len()).map(|same| same[0]);
        members
            .retain(|m| (!weak(m) || Some(m.corner) == hub) && hub.is_none_or(|v| self.lies_in(m.place, v)));
        let flat: Vec<u32> = members.iter().map(|m| m.place).collect();
        // Both are in the order of the bundle.
        let mut taken = flat.iter().peekable();
        bundle.retain(|place| taken.next_if_eq(&place).is_none());
        flat
    }

    /// The triangles with their noise about the plane of the largest of them; not those with more noise than
    /// tolerance.
    fn members(&self, bundle: &[u32]) -> Vec<Member> {
        let corners = |&place: &u32| self.shown.corners_in_view(self.triangle(place));
        let twice_area = |place: &u32| {
            let [a, b, c] = corners(place);
            (b - a).cross(c - a).length_squared()
        };
        let Some(largest) = bundle.iter().max_by(|a, b| twice_area(a).total_cmp(&twice_area(b))) else {
            return Vec::new();
        };
        let (normal, point) = (self.planes[*largest as usize].normal, corners(largest)[0]);
        let all = || bundle.iter().flat_map(corners);
        let (min, max) = all().fold((point, point), |(min, max), c| (min.min(c), max.max(c)));
        let size = (max - min).length();
        let rounding = ROUNDING * min.abs().max(max.abs()).max_element();
        let member = |place: &u32| {
            let corners = corners(place);
            let rise = corners.iter().fold(0.0, |most: f64, c| most.max(normal.dot(c - point).abs()));
            let own = self.planes[*place as usize].normal;
            let tilt = (own - normal).length().min((own + normal).length()) * size;
            let mut tolerances = [0, 1, 2].map(|k| (self.shown.lens.rounding_of_point(corners[k]), k));
            tolerances.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            Member {
                place: *place,
                noise: 2.0 * (rise + tilt + rounding),
                tolerance: tolerances[1].0,
                least: tolerances[0].0,
                corner: self.shown.triangles[self.triangle(*place) as usize][tolerances[0].1],
            }
        };
        bundle.iter().map(member).filter(|m| m.noise <= m.tolerance).collect()
    }

    /// Whether a vertex lies in the plane of a triangle.
    fn lies_in(&self, place: u32, vertex: u32) -> bool {
        let point = self.shown.in_view[vertex as usize];
        let of = self.shown.corners_in_view(self.triangle(place))[0];
        let side = self.planes[place as usize].normal.dot(point - of);
        side.abs() <= self.shown.lens.rounding_of_point(point)
    }
}

/// A value that as many as possible have between their noise and their tolerance.
fn most_common(members: &[Member]) -> f64 {
    let mut noises: Vec<f64> = members.iter().map(|m| m.noise).collect();
    let mut tolerances: Vec<f64> = members.iter().map(|m| m.tolerance).collect();
    noises.sort_unstable_by(f64::total_cmp);
    tolerances.sort_unstable_by(f64::total_cmp);
    let (mut best, mut most, mut ended) = (0.0, 0, 0);
    for (k, &level) in noises.iter().enumerate() {
        // No interval ends before it begins: fewer have ended than have begun.
        while tolerances[ended] < level {
            ended += 1;
        }
        if k + 1 - ended > most {
            (best, most) = (level, k + 1 - ended);
        }
    }
    best
}
