//! Against separating axes in whole numbers, which never round; then at the edge of what f64 can tell.

use super::*;
use proptest::prelude::*;

type Whole = [i128; 3];

fn cross(a: Whole, b: Whole) -> Whole {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn minus(a: Whole, b: Whole) -> Whole {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Whole, b: Whole) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn span(axis: Whole, points: &[Whole]) -> (i128, i128) {
    let along = points.iter().map(|&p| dot(axis, p));
    (along.clone().min().unwrap(), along.max().unwrap())
}

/// A convex body with whole corners; faces may be missing or without area.
#[derive(Clone, Debug)]
struct Body {
    corners: Vec<Whole>,
    faces: Vec<Vec<usize>>,
}

#[derive(Clone, Copy, Debug)]
struct WholeBox {
    min: Whole,
    max: Whole,
}

impl WholeBox {
    fn corners(&self) -> Vec<Whole> {
        (0..8)
            .map(|i| {
                std::array::from_fn(|axis| if i >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] })
            })
            .collect()
    }

    fn real(&self) -> Aabb {
        Aabb { min: real(self.min), max: real(self.max) }
    }
}

fn real(p: Whole) -> DVec3 {
    DVec3::from_array(p.map(|c| c as f64))
}

impl Body {
    fn normal(&self, face: &[usize]) -> Whole {
        let arms: Vec<Whole> = face.iter().map(|&v| minus(self.corners[v], self.corners[face[0]])).collect();
        arms.windows(2).map(|w| cross(w[0], w[1])).fold([0; 3], |s, n| std::array::from_fn(|i| s[i] + n[i]))
    }

    /// Every axis on which the body and a box can be told apart.
    fn axes(&self) -> Vec<Whole> {
        let sides = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
        let mut axes = sides.to_vec();
        for face in &self.faces {
            axes.push(self.normal(face));
            for (i, &from) in face.iter().enumerate() {
                let edge = minus(self.corners[face[(i + 1) % face.len()]], self.corners[from]);
                axes.extend(sides.map(|side| cross(edge, side)));
            }
        }
        axes
    }

    fn meets(&self, b: &WholeBox) -> bool {
        self.axes().iter().all(|&axis| {
            let ((a, c), (d, e)) = (span(axis, &self.corners), span(axis, &b.corners()));
            a <= e && d <= c
        })
    }

    /// The true answer; `crossed` as the planes of faces with area say.
    fn overlap(&self, b: &WholeBox) -> Overlap {
        if !self.meets(b) {
            return Overlap::Outside;
        }
        let mut crossed = 0u64;
        let mut solid = false;
        for (i, face) in self.faces.iter().enumerate() {
            let normal = self.normal(face);
            if normal == [0; 3] {
                continue;
            }
            let level = dot(normal, self.corners[face[0]]);
            let (low, high) = span(normal, &b.corners());
            solid |= span(normal, &self.corners) != (level, level);
            if low <= level && level <= high {
                crossed |= 1 << i;
            }
        }
        if crossed == 0 && solid { Overlap::Inside } else { Overlap::Partial { crossed } }
    }

    fn real(&self, scale: f64) -> ConvexPolyhedron {
        let corners: Vec<DVec3> = self.corners.iter().map(|&c| real(c) * scale).collect();
        ConvexPolyhedron::new(&corners, &self.faces)
    }
}

fn whole(reach: i128) -> impl Strategy<Value = Whole> {
    [-reach..=reach, -reach..=reach, -reach..=reach]
}

fn whole_box(reach: i128) -> impl Strategy<Value = WholeBox> {
    (whole(reach), whole(reach)).prop_map(|(a, b)| WholeBox {
        min: std::array::from_fn(|i| a[i].min(b[i])),
        max: std::array::from_fn(|i| a[i].max(b[i])),
    })
}

/// Any four points; often flat, sometimes a segment or a point.
fn tetrahedron(reach: i128) -> impl Strategy<Value = Body> {
    prop::collection::vec(whole(reach), 4).prop_map(|corners| Body {
        corners,
        faces: vec![vec![0, 1, 2], vec![0, 3, 1], vec![1, 3, 2], vec![0, 2, 3]],
    })
}

/// The faces of eight corners numbered by bits.
fn hexahedron(corners: Vec<Whole>) -> Body {
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Body { corners, faces: faces.map(|f| f.to_vec()).to_vec() }
}

/// A truncated pyramid: `apex` + t · (`axis` ± `right` ± `up`), t from `near` to `far`. All planar.
fn frustum(reach: i128) -> impl Strategy<Value = Body> {
    let frame = [whole(reach), whole(reach), whole(reach), whole(reach)];
    (frame, 0..3i128, 0..4i128).prop_map(|([apex, axis, right, up], near, depth)| {
        let corner = |i: usize| {
            let t = if i & 4 == 0 { near } else { near + depth };
            let (r, u) = (if i & 1 == 0 { -1 } else { 1 }, if i & 2 == 0 { -1 } else { 1 });
            std::array::from_fn(|k| apex[k] + t * (axis[k] + r * right[k] + u * up[k]))
        };
        hexahedron((0..8).map(corner).collect())
    })
}

fn body(reach: i128) -> impl Strategy<Value = Body> {
    prop_oneof![tetrahedron(reach), frustum(reach)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    /// Small whole numbers are exact in f64, so that touching is told from parting to the last unit; boxes
    /// and bodies are often flat, and often touch.
    #[test]
    fn small_whole_numbers_are_classified_exactly(body in body(3), b in whole_box(5)) {
        let found = body.real(1.0).classify(&b.real());
        let expected = body.overlap(&b);
        prop_assert_eq!(found == Overlap::Outside, expected == Overlap::Outside, "{:?} {:?}", found, expected);
        if let (Overlap::Partial { crossed: found }, Overlap::Partial { crossed: expected }) = (found, expected) {
            // The paper's short cut for a body within the box names faces without area too.
            let with_area = (0..body.faces.len()).filter(|&i| body.normal(&body.faces[i]) != [0; 3]);
            let planes = with_area.fold(0u64, |bits, i| bits | 1 << i);
            prop_assert_eq!(found & planes, expected & planes);
        } else {
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn scaling_by_powers_of_two_changes_nothing(
        body in body(3), b in whole_box(5), exponent in prop::sample::select(vec![-300, -66, 60, 61, 300]),
    ) {
        let scale = 2f64.powi(exponent);
        let scaled = Aabb { min: real(b.min) * scale, max: real(b.max) * scale };
        prop_assert_eq!(body.real(scale).classify(&scaled), body.real(1.0).classify(&b.real()));
    }

    /// Numbers whose products round: never outside when they meet, and outside when the gap is plain.
    #[test]
    fn large_whole_numbers_never_part_what_meets(body in body(1 << 24), b in whole_box(1 << 26)) {
        let found = body.real(1.0).classify(&b.real());
        if body.meets(&b) {
            prop_assert_ne!(found, Overlap::Outside);
        }
        if found == Overlap::Inside {
            prop_assert_eq!(body.overlap(&b), Overlap::Inside);
        }
        let grown = WholeBox { min: b.min.map(|c| c - 1), max: b.max.map(|c| c + 1) };
        if !body.meets(&grown) {
            prop_assert_eq!(found, Overlap::Outside);
        }
    }

    /// Boxes that truly touch a corner, an edge's middle or a face's middle of a body far from the origin.
    #[test]
    fn what_touches_is_never_outside(
        body in body(1 << 20),
        offset in whole(1 << 28),
        corners in [0usize..8, 0usize..8],
        size in [0..1i128 << 22, 0..1i128 << 22, 0..1i128 << 22],
        octant in 0u8..8,
    ) {
        let moved: Vec<Whole> =
            body.corners.iter().map(|c| std::array::from_fn(|i| 2 * (c[i] + offset[i]))).collect();
        let body = Body { corners: moved, faces: body.faces };
        let [p, q] = corners.map(|c| body.corners[c % body.corners.len()]);
        let touch: Whole = std::array::from_fn(|i| (p[i] + q[i]) / 2);
        let other: Whole =
            std::array::from_fn(|i| if octant >> i & 1 == 0 { touch[i] + size[i] } else { touch[i] - size[i] });
        let b = WholeBox {
            min: std::array::from_fn(|i| touch[i].min(other[i])),
            max: std::array::from_fn(|i| touch[i].max(other[i])),
        };
        prop_assert!(body.real(1.0).intersects(&b.real()));
    }

    #[test]
    fn polygons_meet_boxes_exactly_in_small_whole_numbers(
        corners in prop::collection::vec(whole(3), 1..4), b in whole_box(4), reversed in any::<bool>(),
    ) {
        let face = (0..corners.len()).collect();
        let body = Body { corners, faces: vec![face] };
        let mut corners: Vec<DVec3> = body.corners.iter().map(|&c| real(c)).collect();
        if reversed {
            corners.reverse();
        }
        let expected = body.meets(&b);
        prop_assert_eq!(box_meets_polygon(&b.real(), &corners), expected);
        let as_body = ConvexPolyhedron::new(&corners, &[(0..corners.len()).collect::<Vec<_>>()]);
        prop_assert_eq!(as_body.intersects(&b.real()), expected);
    }

    #[test]
    fn quads_meet_boxes_exactly_in_small_whole_numbers(
        origin in whole(3), u in whole(2), v in whole(2), b in whole_box(4),
    ) {
        let at = |s: i128, t: i128| -> Whole { std::array::from_fn(|i| origin[i] + s * u[i] + t * v[i]) };
        let body = Body { corners: vec![at(0, 0), at(1, 0), at(2, 1), at(0, 1)], faces: vec![vec![0, 1, 2, 3]] };
        let corners: Vec<DVec3> = body.corners.iter().map(|&c| real(c)).collect();
        prop_assert_eq!(box_meets_polygon(&b.real(), &corners), body.meets(&b));
    }

    /// A box around a point of a triangle with arbitrary coordinates meets it.
    #[test]
    fn a_box_around_a_point_of_a_triangle_meets_it(
        corners in prop::collection::vec([-1e3..1e3f64, -1e3..1e3, -1e3..1e3], 3),
        (u, v) in (0.0..1.0f64, 0.0..1.0f64),
        exponent in -60i32..60,
    ) {
        let corners: Vec<DVec3> = corners.into_iter().map(|c| DVec3::from_array(c) * 2f64.powi(exponent)).collect();
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let p = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
        let slack = DVec3::splat(2f64.powi(exponent) * 1e-12);
        let around = Aabb { min: p - slack, max: p + slack };
        prop_assert!(box_meets_polygon(&around, &corners));
        prop_assert!(box_meets_polygon(&Aabb::around(corners.iter().copied()), &corners));
    }

    /// Looking only at the planes that the parent crossed gives the child's own answer.
    #[test]
    fn a_childs_answer_follows_from_its_parents(body in body(3), b in whole_box(6), child in 0usize..8) {
        let (body, parent) = (body.real(1.0), b.real());
        let middle = parent.center();
        let pick = BVec3::new(child & 1 == 0, child & 2 == 0, child & 4 == 0);
        let child = Aabb {
            min: DVec3::select(pick, parent.min, middle),
            max: DVec3::select(pick, middle, parent.max),
        };
        match body.classify(&parent) {
            Overlap::Outside => prop_assert_eq!(body.classify(&child), Overlap::Outside),
            Overlap::Inside => prop_assert_eq!(body.classify(&child), Overlap::Inside),
            Overlap::Partial { crossed } => {
                prop_assert_eq!(body.classify_within(&child, crossed), body.classify(&child));
            }
        }
    }
}

#[test]
fn a_box_beside_a_slanted_edge_needs_an_edge_line() {
    let corners = [DVec3::new(2.25, 0.0, 0.5), DVec3::new(0.0, 2.25, 0.5), DVec3::new(3.0, 3.0, 0.625)];
    let body = ConvexPolyhedron::new(&corners, &[[0usize, 1, 2]]);
    let unit = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
    assert!(meet(body.bounds(), &unit) && !body.faces.iter().any(|f| f.support.separates(&unit)));
    assert_eq!(body.classify(&unit), Overlap::Outside);
    assert!(!box_meets_polygon(&unit, &corners));
    let reaching = Aabb { max: DVec3::splat(1.125), ..unit };
    assert!(body.intersects(&reaching) && box_meets_polygon(&reaching, &corners));
}

#[test]
fn a_view_frustum_has_greenes_number_of_planes_and_lines() {
    let eye = DVec3::new(3.0, 1.0, 2.0);
    let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
    let view = View::look_at(eye, DVec3::new(-2.0, 0.3, 0.4), DVec3::Y, projection, (640, 480));
    let frustum = ConvexPolyhedron::view_frustum(&view, 50.0);
    assert_eq!(frustum.faces.len(), 6);
    assert!((12..=18).contains(&frustum.edges.len()), "{} edge-lines", frustum.edges.len());
    let forward = (DVec3::new(-2.0, 0.3, 0.4) - eye).normalize();
    let small = |at: DVec3| Aabb { min: at - 0.01, max: at + 0.01 };
    assert_eq!(frustum.classify(&small(eye + forward)), Overlap::Inside);
    assert_eq!(frustum.classify(&small(eye + forward * 50.0)), Overlap::Partial { crossed: 1 << 5 });
    assert_eq!(frustum.classify(&small(eye + forward * 0.1)), Overlap::Partial { crossed: 1 << 4 });
    assert_eq!(frustum.classify(&small(eye - forward)), Overlap::Outside);
    let far = forward.cross(DVec3::Y).normalize() * 30.0 * (0.5f64.tan() * 4.0 / 3.0);
    assert_eq!(frustum.classify(&small(eye + forward * 30.0 + far)), Overlap::Partial { crossed: 1 << 1 });
}

#[test]
fn empty_infinite_and_meaningless_boxes_are_answered_safely() {
    let body = hexahedron(WholeBox { min: [-1; 3], max: [1; 3] }.corners()).real(1.0);
    assert_eq!(body.classify(&Aabb::EMPTY), Overlap::Outside);
    let everything = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
    assert_eq!(body.classify(&everything), Overlap::Partial { crossed: 0b11_1111 });
    let half = Aabb { min: DVec3::new(f64::NEG_INFINITY, -0.5, -0.5), max: DVec3::new(0.0, 0.5, 0.5) };
    assert!(body.intersects(&half));
    let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
    assert!(box_meets_polygon(&everything, &triangle) && !box_meets_polygon(&Aabb::EMPTY, &triangle));
    assert!(!box_meets_polygon(&everything, &[]));
    let nothing = ConvexPolyhedron::new::<Vec<usize>>(&[], &[]);
    assert_eq!(nothing.classify(&everything), Overlap::Outside);
}

/// A tilted plane at 1/3, which f64 does not hold, and boxes one unit in the last place on either side.
#[test]
fn the_bound_holds_at_its_end_points() {
    let third = 1.0 / 3.0;
    let triangle = [DVec3::new(third, 0.0, 0.0), DVec3::new(0.0, third, 0.0), DVec3::new(0.0, 0.0, third)];
    let corner = |d: f64| Aabb { min: DVec3::splat(d), max: DVec3::splat(1.0) };
    // x + y + z = third at x = y = z = third / 3; beyond by far more than rounding, it is apart.
    let exact = third / 3.0;
    assert!(box_meets_polygon(&corner(exact), &triangle));
    assert!(box_meets_polygon(&corner(exact.next_down()), &triangle));
    assert!(!box_meets_polygon(&corner(exact * (1.0 + 8.0 * ROUNDING)), &triangle));
    let body = ConvexPolyhedron::new(&triangle, &[[0usize, 1, 2]]);
    assert!(body.intersects(&corner(exact)) && !body.intersects(&corner(exact * (1.0 + 8.0 * ROUNDING))));
}
