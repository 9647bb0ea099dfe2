//! Round bodies as they are kept: few bytes, in the order in which they are read.
//!
//! A normal has ten bits for a coordinate: which one is taken for a face is free, for d is found for it. A ball has eight
//! for each of its numbers. An edge has twelve for each end and four for each of its faces: places among sixteen, of
//! which its pair says which.

use crate::cull::buffer::convex::are_roughly_convex;
use crate::cull::buffer::occluder::{ENDS, Face, Vertices};
use crate::index::{Box3, blocks_of_boxes};
use fearless_simd::{Simd, f32x16, i32x16, prelude::*};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// Patches of more faces are not drawn so: each tile looks at all of them.
const MOST_FACES: usize = 1024;

/// Those of fewer are drawn in other ways: to place their few corners costs little.
const LEAST_FACES: usize = 17;

/// Faces of four corners whose halves differ by more (the length between their normals) become two.
const FLAT: f64 = 1e-3;

/// No coordinate of a normal is larger.
pub(super) const NORMAL: f64 = 511.0;

/// The round bodies of an occluder, one after another.
#[derive(Debug, Default)]
pub(in crate::cull::buffer) struct RoundBodies {
    sixteen: Vec<SixteenFaces>,
    pair: Vec<Pair>,
    edge: Vec<i32>,
    vertex: Vec<[f32; 3]>,
}

/// A closed convex patch.
#[derive(Clone, Debug)]
pub(in crate::cull::buffer) struct Round {
    /// What is its of the lists above.
    sixteen: Range<u32>,
    pair: Range<u32>,
    edge: Range<u32>,
    vertex: Range<u32>,
    /// What its planes are relative to.
    pub(super) middle: DVec3,
    /// No corner is farther from there.
    pub(super) reach: f64,
    /// The least coordinates of its corners, relative to the middle, and what the numbers of balls count.
    pub(super) low: DVec3,
    pub(super) unit: f64,
}

/// Sixteen faces. What is beyond the last faces nobody.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct SixteenFaces {
    /// Outwards, ten bits for each coordinate.
    normal: [i32; 16],
    /// `n·p ≥ d` at all corners.
    pub d: [f32; 16],
    /// A ball around each: eight bits for each coordinate of its center, and for its radius.
    ball: [i32; 16],
}

/// How many edges there are between faces of one sixteen and of another, or the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub sixteens: [u8; 2],
    pub edges: u16,
}

/// A body of those. An edge says in which lane of the first sixteen of its pair its left face is, in which of the other
/// its right one, and which two vertices it connects. As many edges more as sixteen are loaded with are anything.
#[derive(Clone, Copy)]
pub(in crate::cull::buffer) struct RoundBody<'a> {
    pub(super) round: &'a Round,
    pub(super) sixteen: &'a [SixteenFaces],
    pub(super) pair: &'a [Pair],
    pub(super) edge: &'a [i32],
    pub(super) vertex: &'a [[f32; 3]],
}

/// A face of three or four corners.
#[derive(Clone, Copy)]
struct Polygon {
    corner: [u16; 4],
    corners: usize,
}

impl RoundBodies {
    /// Adds a patch, if it is closed and roughly convex, and has neither few faces nor too many.
    pub fn push(&mut self, faces: &[Face], vertices: &Vertices, first_vertex: u32) -> Option<Round> {
        let closed = faces.iter().all(|f| !f.across[..usize::from(f.corners)].contains(&ENDS));
        if !(LEAST_FACES..=MOST_FACES).contains(&faces.len()) || !closed {
            return None;
        }
        let corner = |v: usize| [vertices.x[v], vertices.y[v], vertices.z[v]];
        let vertex: Vec<[f32; 3]> = (first_vertex as usize..vertices.x.len()).map(corner).collect();
        let points: Vec<DVec3> = vertex.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
        let mut polygons = flat(faces, &points);
        let planes = polygons.iter().map(|polygon| {
            let [normal, second] = normals(polygon, &points);
            let normal = if second == DVec3::ZERO { second } else { normal };
            (normal, normal.dot(points[usize::from(polygon.corner[0])]))
        });
        if polygons.len() > MOST_FACES || !are_roughly_convex(&points, planes) {
            return None;
        }
        sort(&mut polygons, &points);
        let (vertex, points) = in_order(&mut polygons, &vertex, &points);
        let edges = edges_of(&polygons)?;
        let (low, high) = points.iter().fold((points[0], points[0]), |(l, h), p| (l.min(*p), h.max(*p)));
        let middle = (low + high) * 0.5;
        let reach = points.iter().map(|p| p.distance(middle)).fold(0.0, f64::max) * (1.0 + 1e-12);
        let counts = [self.sixteen.len(), self.pair.len(), self.edge.len(), self.vertex.len()];
        let unit = (high - low).max_element() / 254.0;
        let mut round = Round {
            sixteen: 0..0,
            pair: 0..0,
            edge: 0..0,
            vertex: 0..0,
            middle,
            reach,
            low: low - middle,
            unit,
        };
        for group in polygons.chunks(16) {
            let mut sixteen = SixteenFaces { normal: [0; 16], d: [1.0; 16], ball: [0; 16] };
            for (lane, polygon) in group.iter().enumerate() {
                let corners = polygon.corner.map(|v| points[usize::from(v)] - middle);
                sixteen.set(lane, &corners, polygon.corners, &round);
            }
            self.sixteen.push(sixteen);
        }
        for (sixteens, edges) in edges {
            self.pair.push(Pair { sixteens, edges: edges.len() as u16 });
            self.edge.extend(edges);
        }
        self.edge.extend([0; 16]);
        self.vertex.extend(vertex);
        let since = |first: usize, now: usize| first as u32..now as u32;
        round.sixteen = since(counts[0], self.sixteen.len());
        round.pair = since(counts[1], self.pair.len());
        round.edge = since(counts[2], self.edge.len());
        round.vertex = since(counts[3], self.vertex.len());
        Some(round)
    }

    #[inline(always)]
    pub fn get<'a>(&'a self, round: &'a Round) -> RoundBody<'a> {
        let of = |range: &Range<u32>| range.start as usize..range.end as usize;
        RoundBody {
            round,
            sixteen: &self.sixteen[of(&round.sixteen)],
            pair: &self.pair[of(&round.pair)],
            edge: &self.edge[of(&round.edge)],
            vertex: &self.vertex[of(&round.vertex)],
        }
    }

    /// Bytes it holds.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.sixteen.as_slice())
            + size_of_val(self.pair.as_slice())
            + size_of_val(self.edge.as_slice())
            + size_of_val(self.vertex.as_slice())
    }
}

/// The faces, those of four corners that are not flat in two.
fn flat(faces: &[Face], points: &[DVec3]) -> Vec<Polygon> {
    let mut polygons = Vec::with_capacity(faces.len());
    for face in faces {
        let corner = face.corner.map(|v| v as u16);
        let [a, b, c, d] = corner;
        let whole = Polygon { corner, corners: usize::from(face.corners) };
        let [first, second] = normals(&whole, points);
        if first.distance(second) < FLAT {
            polygons.push(whole);
        } else {
            polygons.extend([[a, b, c, a], [a, c, d, a]].map(|corner| Polygon { corner, corners: 3 }));
        }
    }
    polygons
}

/// The normals of both triangles of a face, or twice that of one. Of length 1, or 0 if there is none.
fn normals(polygon: &Polygon, points: &[DVec3]) -> [DVec3; 2] {
    let [a, b, c, d] = polygon.corner.map(|v| points[usize::from(v)]);
    let first = (b - a).cross(c - a).normalize_or_zero();
    let second = (c - a).cross(d - a).normalize_or_zero();
    if polygon.corners == 3 { [first; 2] } else { [first, second] }
}

/// Brings those together that lie together, so that sixteen of them mostly turn the same way.
fn sort(polygons: &mut Vec<Polygon>, points: &[DVec3]) {
    let boxes: Vec<(Box3, u32)> = polygons
        .iter()
        .zip(0..)
        .map(|(polygon, number)| {
            let corners = polygon.corner.map(|v| points[usize::from(v)].as_vec3().to_array());
            let around = corners.iter().fold(Box3::EMPTY, |b, &p| b.union(&Box3 { min: p, max: p }));
            (around, number)
        })
        .collect();
    let order = blocks_of_boxes(&boxes, 16).concat();
    *polygons = order.iter().map(|&number| polygons[number as usize]).collect();
}

/// Numbers the vertices as faces use them, so that those that lie together are read together.
fn in_order(polygons: &mut [Polygon], vertex: &[[f32; 3]], points: &[DVec3]) -> (Vec<[f32; 3]>, Vec<DVec3>) {
    let mut number = vec![None; points.len()];
    let mut order = Vec::with_capacity(points.len());
    for corner in polygons.iter_mut().flat_map(|polygon| &mut polygon.corner) {
        let old = usize::from(*corner);
        *corner = *number[old].get_or_insert_with(|| {
            order.push(old);
            order.len() as u16 - 1
        });
    }
    (order.iter().map(|&v| vertex[v]).collect(), order.iter().map(|&v| points[v]).collect())
}

/// Edges by the sixteens of their faces; they run around the first.
type Edges = BTreeMap<[u8; 2], Vec<i32>>;

/// The edges of a surface; nothing, if not every one has exactly one face on each side.
fn edges_of(polygons: &[Polygon]) -> Option<Edges> {
    let mut left = HashMap::new();
    for (number, polygon) in polygons.iter().enumerate() {
        for k in 0..polygon.corners {
            let ends = [polygon.corner[k], polygon.corner[(k + 1) % polygon.corners]];
            if left.insert(ends, number).is_some() {
                return None;
            }
        }
    }
    let mut edges = Edges::new();
    for (number, polygon) in polygons.iter().enumerate() {
        for k in 0..polygon.corners {
            let ends = [polygon.corner[k], polygon.corner[(k + 1) % polygon.corners]];
            let across = *left.get(&[ends[1], ends[0]])?;
            if number < across {
                let sixteens = [number / 16, across / 16].map(|n| n as u8);
                let [a, b] = ends.map(i32::from);
                let lanes = (number % 16 + across % 16 * 16) as i32;
                edges.entry(sixteens).or_default().push(lanes | a << 8 | b << 20);
            }
        }
    }
    Some(edges)
}

impl SixteenFaces {
    /// Takes a face, given its corners relative to the middle.
    fn set(&mut self, lane: usize, corners: &[DVec3; 4], count: usize, round: &Round) {
        let [a, b, c, d] = *corners;
        let normal = if count == 3 { (b - a).cross(c - a) } else { (c - a).cross(d - b) };
        let normal = (normal * (NORMAL / normal.abs().max_element())).round();
        let least = corners.iter().map(|p| normal.dot(*p)).fold(f64::INFINITY, f64::min);
        self.d[lane] = ((least - least.abs() * 1e-12) as f32).next_down();
        let bits = |v: f64, shift: u32| (v as i32 & 1023) << shift;
        self.normal[lane] = bits(normal.x, 0) | bits(normal.y, 10) | bits(normal.z, 20);
        let center = corners[..count].iter().sum::<DVec3>() / count as f64;
        let center = ((center - round.low) / round.unit).round();
        let at = round.low + center * round.unit;
        let radius = corners.iter().map(|p| p.distance(at)).fold(0.0, f64::max);
        let radius = (radius / round.unit * (1.0 + 1e-9)).ceil().min(255.0);
        self.ball[lane] =
            center.x as i32 | (center.y as i32) << 8 | (center.z as i32) << 16 | (radius as i32) << 24;
    }

    #[inline(always)]
    pub fn normal<S: Simd>(&self, simd: S) -> [f32x16<S>; 3] {
        let bits = i32x16::from_slice(simd, &self.normal);
        let (x, y, z) = ((bits << 22) >> 22, (bits << 12) >> 22, (bits << 2) >> 22);
        [x.to_float(), y.to_float(), z.to_float()]
    }

    /// Numbers of the balls, of which each counts [`Round::unit`].
    #[inline(always)]
    pub fn ball<S: Simd>(&self, simd: S) -> [f32x16<S>; 4] {
        let bits = i32x16::from_slice(simd, &self.ball);
        let byte = i32x16::splat(simd, 255);
        let (x, y) = ((bits & byte).to_float(), ((bits >> 8) & byte).to_float());
        [x, y, ((bits >> 16) & byte).to_float(), ((bits >> 24) & byte).to_float()]
    }
}
