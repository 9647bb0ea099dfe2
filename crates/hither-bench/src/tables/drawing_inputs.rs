//! What line drawing is measured on: polygons as OBJ text, seen from the front.
//!
//! Cubes and bumpy spheres are those that the figures of other software were measured on, vertex for vertex.
//! The toothpicks are made alike (200 disjoint ellipsoids of 8 by 41 faces in a cube), from a generator of
//! our own.

use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Polygons with shared vertices.
#[derive(Default)]
pub(super) struct Polygons {
    positions: Vec<DVec3>,
    faces: Vec<Vec<u32>>,
}

impl Polygons {
    fn add(&mut self, positions: &[DVec3], faces: &[Vec<u32>]) {
        let first = self.positions.len() as u32;
        self.positions.extend(positions);
        self.faces.extend(faces.iter().map(|f| f.iter().map(|v| v + first).collect()));
    }

    /// OBJ text. The eye of the figures, at (3, −5, 2.2) over a floor with z up, looks from the front.
    pub fn obj(&self) -> String {
        let back = DVec3::new(3.0, -5.0, 2.2).normalize();
        let right = DVec3::Z.cross(back).normalize();
        let up = back.cross(right);
        let mut text = String::with_capacity(self.positions.len() * 40 + self.faces.len() * 24);
        for p in &self.positions {
            let _ = writeln!(text, "v {:.9} {:.9} {:.9}", p.dot(right), p.dot(up), p.dot(back));
        }
        for face in &self.faces {
            text.push('f');
            for v in face {
                let _ = write!(text, " {}", v + 1);
            }
            text.push('\n');
        }
        text
    }

    /// Triangles that the polygons make.
    pub fn triangles(&self) -> usize {
        self.faces.iter().map(|f| f.len() - 2).sum()
    }
}

const CUBE_FACES: [[u32; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

fn cube() -> ([DVec3; 8], Vec<Vec<u32>>) {
    let corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)];
    let corners = corners.map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
    (corners, CUBE_FACES.iter().map(|f| f.to_vec()).collect())
}

/// n × n × n cubes with gaps of half their side.
pub(super) fn cubes(n: u32) -> Polygons {
    const PITCH: f64 = 1.5;
    let (corners, faces) = cube();
    let mut all = Polygons::default();
    let middle = f64::from(n - 1) * PITCH * 0.5 + 0.5;
    for i in 0..n * n * n {
        let at = DVec3::new(f64::from(i / (n * n)), f64::from(i / n % n), f64::from(i % n)) * PITCH - middle;
        all.add(&corners.map(|c| c + at), &faces);
    }
    all
}

/// A cube and a bar through it.
pub(super) fn pierced() -> Polygons {
    let (corners, faces) = cube();
    let mut all = Polygons::default();
    all.add(&corners, &faces);
    let bar = corners.map(|c| c * DVec3::new(1.6, 0.4, 0.4) + DVec3::new(-0.3, 0.3, 0.3));
    all.add(&bar, &faces);
    all
}

/// A surface over longitudes and latitudes; of triangles, or of quadrilaterals but at the poles.
fn rounds(
    columns: u32,
    rows: u32,
    triangles: bool,
    at: impl Fn(f64, f64) -> DVec3,
) -> (Vec<DVec3>, Vec<Vec<u32>>) {
    let mut positions = vec![at(0.0, 0.0)];
    for i in 1..rows {
        for j in 0..columns {
            positions.push(at(PI * f64::from(i) / f64::from(rows), TAU * f64::from(j) / f64::from(columns)));
        }
    }
    positions.push(at(PI, 0.0));
    let south = positions.len() as u32 - 1;
    let id = |i: u32, j: u32| 1 + (i - 1) * columns + j % columns;
    let mut faces: Vec<Vec<u32>> = (0..columns).map(|j| vec![0, id(1, j), id(1, j + 1)]).collect();
    for i in 1..rows - 1 {
        for j in 0..columns {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            if triangles {
                faces.extend([vec![a, b, c], vec![a, c, d]]);
            } else {
                faces.push(vec![a, b, c, d]);
            }
        }
    }
    faces.extend((0..columns).map(|j| vec![south, id(rows - 1, j + 1), id(rows - 1, j)]));
    (positions, faces)
}

/// A sphere with bumps, of 2 × columns² triangles.
pub(super) fn bumps(columns: u32) -> Polygons {
    let at = |t: f64, p: f64| {
        let r = 1.0 + 0.15 * (6.0 * p).sin() * (6.0 * t).sin() * t.sin();
        DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos()) * r
    };
    let (positions, faces) = rounds(columns, columns + 1, true, at);
    Polygons { positions, faces }
}

/// Thin ellipsoids that do not touch, in a cube of side 2.
pub(super) fn toothpicks(count: usize) -> Polygons {
    let mut state = 12345u64;
    let mut unit = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let shape =
        |t: f64, p: f64| DVec3::new(0.025 * t.sin() * p.cos(), 0.025 * t.sin() * p.sin(), 0.5 * t.cos());
    let (ellipsoid, faces) = rounds(8, 41, false, shape);
    let mut axes: Vec<(DVec3, DVec3)> = Vec::new();
    let mut all = Polygons::default();
    while axes.len() < count {
        let center = DVec3::new(unit(), unit(), unit()) * 2.0 - 1.0;
        let direction = DVec3::new(unit(), unit(), unit()) * 2.0 - 1.0;
        if !(0.01..=1.0).contains(&direction.length()) {
            continue;
        }
        let direction = direction.normalize();
        if axes.iter().any(|(c, d)| distance((center, direction * 0.5), (*c, *d * 0.5)) < 0.051) {
            continue;
        }
        axes.push((center, direction));
        let aside = if direction.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
        let x = direction.cross(aside).normalize();
        let y = direction.cross(x);
        let placed: Vec<DVec3> =
            ellipsoid.iter().map(|p| center + x * p.x + y * p.y + direction * p.z).collect();
        all.add(&placed, &faces);
    }
    all
}

/// Distance of two segments, each a middle and half its length.
fn distance((p, d): (DVec3, DVec3), (q, e): (DVec3, DVec3)) -> f64 {
    let w = p - q;
    let (a, b, c) = (d.dot(d), d.dot(e), e.dot(e));
    let (dd, ee) = (d.dot(w), e.dot(w));
    let determinant = a * c - b * b;
    let mut s = if determinant > 1e-12 { ((b * ee - c * dd) / determinant).clamp(-1.0, 1.0) } else { 0.0 };
    let mut t = 0.0;
    for _ in 0..3 {
        t = ((b * s + ee) / c).clamp(-1.0, 1.0);
        s = ((b * t - dd) / a).clamp(-1.0, 1.0);
    }
    (w + s * d - t * e).length()
}
