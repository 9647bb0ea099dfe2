//! Closed bodies whose backs need not be looked at.
//!
//! A connected run of triangles that is closed, wound alike, and seen from some point inside with every
//! triangle turned the same way, once around, is the boundary of a *star-shaped* body: it does not pass
//! through itself. From an eye outside, whatever is behind one of its back faces is behind one of its front
//! faces, too. So its back faces hide nothing that is not hidden anyway, and nothing on them is seen.
//!
//! Where, moreover, the outline of its front faces on the paper is star-shaped around a point, once around,
//! the front faces cover no point twice: a point is covered as often as their outline winds around it. Then
//! no edge of theirs is hidden by the body itself. [`Bodies::sheets`] finds such bodies in a view.
//!
//! All signs are exact, or certain where they say yes.

use super::crew::Crew;
use super::predicates::{counts_as_left, cross};
use super::runs::Runs;
use super::topology::{Edge, NONE, Topology};
use glam::{DVec3, Vec3};

/// The star-shaped bodies of a mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Bodies {
    /// The body of each triangle, or [`NONE`]; empty where there are no bodies.
    pub of: Vec<u32>,
    pub list: Vec<Body>,
}

/// A star-shaped body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// A point from which all of it is seen.
    pub center: DVec3,
    /// Whether its triangles wind counter-clockwise, seen from outside.
    pub outward: bool,
}

/// Least volume of a corner seen from the centre, relative to the product of its sides' lengths, that is
/// certainly not zero: some sixty times what rounding makes.
const CERTAIN: f64 = 1e-14;

impl Bodies {
    /// Finds the bodies of a mesh. Three passes over the triangles in their order, which takes less time than a
    /// walk from neighbour to neighbour.
    pub fn find(crew: Crew, topology: &Topology) -> Bodies {
        let Topology { positions, triangles, neighbours, flips, .. } = topology;
        let mut run_of = connected(neighbours);
        let mut runs: Vec<Run> = Vec::new();
        for t in 0..triangles.len() {
            if triangles[t][0] == NONE {
                run_of[t] = NONE;
                continue;
            }
            // A run's first triangle has its number already.
            let first = run_of[t] as usize;
            run_of[t] = if first == t { runs.len() as u32 } else { run_of[first] };
            if first == t {
                runs.push(Run::default());
            }
            let run = &mut runs[run_of[t] as usize];
            run.failed |= flips[t] != 0 || neighbours[t].contains(&NONE);
            for v in triangles[t] {
                let p = positions[v as usize];
                (run.min, run.max) = (run.min.min(p), run.max.max(p));
            }
        }
        // A share keeps all runs: with many runs that would be more than the triangles.
        let threads = if runs.len() < triangles.len() / 16 { crew.threads } else { 1 };
        let looked = crew.map(Crew { threads }.shares(triangles.len(), 1), |range| {
            let mut runs = runs.clone();
            for (t, &run) in range.clone().zip(&run_of[range]).filter(|(_, run)| **run != NONE) {
                let run = &mut runs[run as usize];
                if !run.failed {
                    let at = |k: usize| positions[triangles[t][k] as usize].as_dvec3();
                    run.look_at(at(0), at(1), at(2));
                }
            }
            runs
        });
        for share in looked {
            runs.iter_mut().zip(share).for_each(|(run, more)| run.join(&more));
        }
        let mut list = Vec::new();
        let number = |run: &Run| {
            let center = run.center();
            (!run.failed && run.rounds == 1).then(|| {
                list.push(Body { center, outward: run.turn > 0 });
                list.len() as u32 - 1
            })
        };
        let numbers: Vec<u32> = runs.iter().map(number).map(|n| n.unwrap_or(NONE)).collect();
        if list.is_empty() {
            return Bodies::default();
        }
        let mut of = run_of;
        of.iter_mut().filter(|b| **b != NONE).for_each(|b| *b = numbers[*b as usize]);
        Bodies { of, list }
    }

    /// The body of a triangle, or [`NONE`].
    #[inline]
    pub fn of(&self, triangle: u32) -> u32 {
        if self.of.is_empty() || triangle == NONE { NONE } else { self.of[triangle as usize] }
    }

    /// For each body, whether its front faces cover no point of the paper twice. Linear in the edges.
    pub fn sheets(&self, crew: Crew, topology: &Topology, paper: &Paper) -> Vec<bool> {
        let edges = &topology.edges;
        // A share keeps a number for each body: with many bodies that would be more than the edges.
        let threads = if self.list.len() < edges.len() / 16 { crew.threads } else { 1 };
        let shares = Crew { threads }.shares(edges.len(), 1);
        let counts = crew.map(shares, |range| self.rounds(&edges[range], topology, paper));
        (0..self.list.len()).map(|b| counts.iter().fold(0u32, |n, c| n.saturating_add(c[b])) == 1).collect()
    }

    /// How often the outline of each body's front is met on the way from its centre along +x; more than
    /// twice where a part of it runs the other way around.
    fn rounds(&self, edges: &[Edge], topology: &Topology, paper: &Paper) -> Vec<u32> {
        let is_front = |t: u32| paper.facing[t as usize] == paper.front[self.of[t as usize] as usize];
        let mut rounds = vec![0u32; self.list.len()];
        for edge in edges {
            let [s, t] = edge.triangles;
            let body = self.of(s);
            if body == NONE {
                continue;
            }
            let fronts = [is_front(s), is_front(t)];
            if fronts[0] == fronts[1] {
                continue;
            }
            let corners = &topology.triangles[if fronts[0] { s } else { t } as usize];
            let [mut a, mut b] = edge.vertices;
            if (0..3).any(|k| corners[k] == b && corners[(k + 1) % 3] == a) {
                (a, b) = (b, a);
            }
            if paper.front[body as usize] < 0 {
                (a, b) = (b, a);
            }
            let (a, b) = (paper.screen[a as usize], paper.screen[b as usize]);
            let center = paper.centers[body as usize];
            let turns_on = cross(a, b, center) > 0.0;
            let met = u32::from(a.y <= center.y && center.y < b.y);
            // An edge that runs the other way spoils it for good.
            let rounds = &mut rounds[body as usize];
            *rounds = rounds.saturating_add(if turns_on { met } else { u32::MAX });
        }
        rounds
    }
}

/// A solid as a view shows it.
pub(super) struct Paper<'a> {
    /// The sense of rotation of each triangle.
    pub facing: &'a [i8],
    pub screen: &'a [DVec3],
    /// For each body, the sense of rotation of its front faces.
    pub front: &'a [i8],
    /// Where each body's centre is.
    pub centers: &'a [DVec3],
}

/// For each triangle the first of those that hang together with it over edges.
fn connected(neighbours: &[[u32; 3]]) -> Vec<u32> {
    let mut runs = Runs::new(neighbours.len());
    for t in 0..neighbours.len() as u32 {
        for n in neighbours[t as usize].into_iter().filter(|&n| n < t) {
            runs.join(t, n);
        }
    }
    runs.firsts()
}

/// What is known of triangles that hang together.
#[derive(Clone, Copy)]
struct Run {
    min: Vec3,
    max: Vec3,
    /// Whether they are no body.
    failed: bool,
    /// How they turn, seen from the centre: 1 if they wind counter-clockwise from outside, −1 if clockwise.
    turn: i8,
    /// How many of them a ray from the centre along +x meets.
    rounds: u32,
}

impl Default for Run {
    fn default() -> Run {
        let (min, max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        Run { min, max, failed: false, turn: 0, rounds: 0 }
    }
}

impl Run {
    fn center(&self) -> DVec3 {
        (self.min.as_dvec3() + self.max.as_dvec3()) * 0.5
    }

    /// Takes in what was seen of the same run elsewhere.
    fn join(&mut self, other: &Run) {
        self.failed |= other.failed || self.turn * other.turn < 0;
        self.turn = if self.turn == 0 { other.turn } else { self.turn };
        self.rounds += other.rounds;
    }

    /// Looks at a triangle from the centre.
    #[inline]
    fn look_at(&mut self, a: DVec3, b: DVec3, c: DVec3) {
        let center = self.center();
        let (p, q, r) = (a - center, b - center, c - center);
        let volume = p.dot(q.cross(r));
        let size = p.abs().element_sum() * q.abs().element_sum() * r.abs().element_sum();
        let turn = if volume > 0.0 { 1 } else { -1 };
        // The comparison fails for NaN, too.
        let certain = volume.abs() > CERTAIN * size;
        self.failed |= !certain || self.turn == -turn;
        self.turn = turn;
        let beside = |p: f64, q: f64, r: f64| p.min(q).min(r) > 0.0 || p.max(q).max(r) < 0.0;
        if beside(p.y, q.y, r.y) || beside(p.z, q.z, r.z) {
            return;
        }
        let flat = |p: DVec3| DVec3::new(p.y, p.z, 0.0);
        let (a, b, c) = if turn > 0 { (flat(a), flat(b), flat(c)) } else { (flat(a), flat(c), flat(b)) };
        let center = flat(center);
        let left = |a: DVec3, b: DVec3| {
            let side = cross(a, b, center);
            side > 0.0 || (side == 0.0 && counts_as_left(a, b))
        };
        self.rounds += u32::from(left(a, b) && left(b, c) && left(c, a));
    }
}

#[cfg(test)]
mod tests {
    use super::super::crew::Crew;
    use super::super::topology::Topology;
    use crate::scene::{Mesh, Primitive, Scene};
    use glam::Vec3;

    /// A closed surface of `rows` rings of `columns` points, `around` times around its axis.
    fn turned(rows: u32, columns: u32, around: f32, at: impl Fn(f32, f32) -> Vec3) -> Mesh {
        let id = |i: u32, j: u32| match i {
            0 => 0,
            i if i == rows => 1,
            i => 2 + (i - 1) * columns + j % columns,
        };
        let angle = |i: u32, of: u32| i as f32 / of as f32 * std::f32::consts::PI;
        let mut positions = vec![at(0.0, 0.0), at(std::f32::consts::PI, 0.0)];
        for i in 1..rows {
            positions.extend((0..columns).map(|j| at(angle(i, rows), around * 2.0 * angle(j, columns))));
        }
        let mut triangles = Vec::new();
        for i in 0..rows {
            for j in 0..columns {
                let (a, b, c, d) = (id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
                triangles.extend(
                    [[a, b, c], [a, c, d]]
                        .into_iter()
                        .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]),
                );
            }
        }
        let primitives = vec![Primitive { triangles: 0..triangles.len() as u32, material: None }];
        Mesh { positions, triangles, primitives, ..Mesh::default() }
    }

    fn ball(t: f32, p: f32) -> Vec3 {
        Vec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos())
    }

    fn bodies(mesh: &Mesh) -> Vec<bool> {
        let topology = Topology::of(Crew { threads: 1 }, &Scene::new("test"), mesh, &[]);
        topology.bodies.list.iter().map(|b| b.outward).collect()
    }

    #[test]
    fn a_ball_is_a_body_whichever_way_it_winds() {
        let mut mesh = turned(7, 9, 1.0, ball);
        assert_eq!(bodies(&mesh), [true]);
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(bodies(&mesh), [false]);
    }

    #[test]
    fn what_is_open_or_winds_in_two_ways_is_no_body() {
        let mut mesh = turned(7, 9, 1.0, ball);
        mesh.triangles[20].swap(0, 1);
        assert!(bodies(&mesh).is_empty());
        mesh.triangles.remove(20);
        mesh.primitives[0].triangles.end -= 1;
        assert!(bodies(&mesh).is_empty());
    }

    #[test]
    fn a_ball_that_goes_around_twice_is_no_body() {
        // Every triangle is turned the same way, seen from inside; only counting tells.
        let twice = |t: f32, p: f32| ball(t, p) * (1.0 + 0.05 * (p / 2.0).cos() * t.sin());
        let mesh = turned(7, 18, 2.0, twice);
        assert!(bodies(&mesh).is_empty());
    }

    #[test]
    fn what_is_not_seen_from_its_middle_is_no_body() {
        let bent = |t: f32, p: f32| {
            let b = ball(t, p) * Vec3::new(0.2, 0.2, 1.0);
            Vec3::new(b.x + 2.0 * b.z * b.z, b.y, b.z)
        };
        assert!(bodies(&turned(12, 9, 1.0, bent)).is_empty());
    }
}
