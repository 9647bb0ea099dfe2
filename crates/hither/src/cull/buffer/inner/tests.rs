//! Every point of every box is inside, on solids made to be nasty; and boxes are large on solids made to be easy.
//!
//! Inside is decided by solid angles, in f64, which share nothing with the search.

use super::*;
use proptest::prelude::*;

type Solid = (Vec<DVec3>, Vec<[u32; 3]>);

/// How often the surface winds round `at`. Boxes keep so far away from the surface that rounding is no matter.
fn winding((points, triangles): &Solid, at: DVec3) -> f64 {
    let size = points.iter().map(|p| (*p - at).abs().max_element()).fold(0.0, f64::max);
    let solid_angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| (points[v as usize] - at) / size);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        2.0 * a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
    };
    triangles.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Finds boxes and asserts that the corners, and points along edges, on faces and within, are inside.
fn checked(solid: &Solid, most: usize) -> Vec<InnerBox> {
    let boxes = inner_boxes(&solid.0, &solid.1, most);
    assert!(boxes.len() <= most);
    for found in &boxes {
        let corner = found.corners.map(|c| c.as_dvec3());
        let [x, y, z] = [1, 2, 4].map(|k| corner[k] - corner[0]);
        assert!(x.cross(y).dot(z) > 0.0, "not right-handed: {found:?}");
        for k in 0..125 {
            let part = DVec3::new(f64::from(k % 5), f64::from(k / 5 % 5), f64::from(k / 25)) / 4.0;
            let weight = |axis: usize, far: bool| if far { part[axis] } else { 1.0 - part[axis] };
            let weights = |i: usize| (0..3).map(|axis| weight(axis, i >> axis & 1 == 1)).product::<f64>();
            let at = (0..8).map(|i| corner[i] * weights(i)).sum();
            let turns = winding(solid, at);
            assert!((turns - turns.round()).abs() < 1e-3 && turns > 0.5, "{turns} at {at} of {found:?}");
        }
    }
    boxes
}

fn volume(found: &InnerBox) -> f64 {
    let c = found.corners.map(|c| c.as_dvec3());
    (c[1] - c[0]).cross(c[2] - c[0]).dot(c[4] - c[0])
}

fn cuboid(min: [f64; 3], max: [f64; 3]) -> Solid {
    let end = |k: u32, axis: usize| if k >> axis & 1 == 0 { min[axis] } else { max[axis] };
    let quads = [[0u32, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    ((0..8).map(|k| DVec3::new(end(k, 0), end(k, 1), end(k, 2))).collect(), triangles)
}

/// Both, as one surface.
fn with((mut points, mut triangles): Solid, other: &Solid) -> Solid {
    let first = points.len() as u32;
    points.extend(&other.0);
    triangles.extend(other.1.iter().map(|t| t.map(|v| v + first)));
    (points, triangles)
}

fn inverted((points, triangles): Solid) -> Solid {
    (points, triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect())
}

/// A simple polygon, counter-clockwise in x and y, from z = 0 to `height`; `fan` is a corner that sees all others.
fn extruded(polygon: &[[f64; 2]], height: f64, fan: usize) -> Solid {
    let n = polygon.len() as u32;
    let points =
        [0.0, height].into_iter().flat_map(|z| polygon.iter().map(move |p| DVec3::new(p[0], p[1], z)));
    let mut triangles = Vec::new();
    for k in 0..n {
        let next = (k + 1) % n;
        triangles.extend([[k, next, next + n], [k, next + n, k + n]]);
        let hub = fan as u32;
        if k != hub && next != hub {
            triangles.extend([[hub, next, k], [hub + n, k + n, next + n]]);
        }
    }
    (points.collect(), triangles)
}

/// Rings of `sides` points round z, closed by two poles; a ring is its points' distances from the axis, and z.
fn lathe(rings: &[(Vec<f64>, f64)], poles: [f64; 2]) -> Solid {
    let sides = rings[0].0.len() as u32;
    let mut points = vec![DVec3::Z * poles[0], DVec3::Z * poles[1]];
    for (radii, z) in rings {
        points.extend((0u32..).zip(radii).map(|(k, r)| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(sides);
            DVec3::new(r * angle.cos(), r * angle.sin(), *z)
        }));
    }
    let mut triangles = Vec::new();
    let last = rings.len() as u32 - 1;
    for k in 0..sides {
        let at = |ring: u32, k: u32| 2 + ring * sides + k % sides;
        triangles.extend([[0, at(0, k + 1), at(0, k)], [1, at(last, k), at(last, k + 1)]]);
        for ring in 0..last {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (points, triangles)
}

/// Mapped, and rounded as positions are.
fn mapped((points, triangles): &Solid, map: glam::DAffine3) -> Solid {
    let moved = points.iter().map(|p| map.transform_point3(*p).as_vec3().as_dvec3()).collect();
    let flipped = map.matrix3.determinant() < 0.0;
    let solid = (moved, triangles.clone());
    if flipped { inverted(solid) } else { solid }
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![3 => -1.0..1.0, 1 => (-4..=4).prop_map(|k| f64::from(k) / 4.0), 1 => -0.001..0.001]
}

fn vector() -> impl Strategy<Value = DVec3> {
    (number(), number(), number()).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// Rotations, scales from 10⁻⁶ to 10⁶, flat ones too, shears, and places far away.
fn map() -> impl Strategy<Value = glam::DAffine3> {
    let turn = prop_oneof![Just(DVec3::ZERO), vector().prop_map(|v| v * 3.0)];
    let scale = (-2i32..=0, -2i32..=0, -6i32..=6);
    let shear = prop_oneof![Just(DVec3::ZERO), vector()];
    let far = prop_oneof![Just(0.0), Just(1.0), Just(100.0), Just(1e5)];
    (turn, scale, shear, vector(), far).prop_map(|(turn, (x, y, all), shear, to, far)| {
        let rotation = glam::DMat3::from_quat(glam::DQuat::from_scaled_axis(turn));
        let sheared = glam::DMat3::from_cols(
            DVec3::X,
            DVec3::new(shear.x, 1.0, 0.0),
            DVec3::new(shear.y, shear.z, 1.0),
        );
        let size = 10f64.powi(all);
        let scaled = glam::DMat3::from_diagonal(DVec3::new(10f64.powi(x), 10f64.powi(y), 1.0) * size);
        glam::DAffine3 { matrix3: rotation * scaled * sheared, translation: to * far * size }
    })
}

/// Closed surfaces: convex and concave, smooth and jagged, self-intersecting, nested, inverted.
fn solid() -> impl Strategy<Value = Solid> {
    let block =
        || (vector(), vector()).prop_map(|(a, b)| cuboid(a.min(b).to_array(), (a.max(b) + 0.01).to_array()));
    let ring = |sides: usize| (prop::collection::vec(0.05..1.0f64, sides), Just(0.0));
    let blob = (3usize..20, 1usize..8).prop_flat_map(move |(sides, rings)| {
        prop::collection::vec(ring(sides), rings).prop_map(|mut rings| {
            let count = rings.len() as f64;
            (0..).zip(&mut rings).for_each(|(k, ring)| ring.1 = 2.0 * f64::from(k) / count);
            lathe(&rings, [-0.3, 2.2])
        })
    });
    let turned =
        (prop::collection::vec((0.05..1.0f64, number()), 1..7), 3usize..40).prop_map(|(rings, sides)| {
            let rings: Vec<_> = rings.into_iter().map(|(r, z)| (vec![r; sides], z)).collect();
            lathe(&rings, [-1.0, 1.0])
        });
    // Any four points, whichever way they turn: what winds round them may be −1.
    let tetrahedra = prop::collection::vec([vector(), vector(), vector(), vector()], 1..6).prop_map(|all| {
        let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        all.into_iter().fold((Vec::new(), Vec::new()), |sum, t| with(sum, &(t.to_vec(), faces.clone())))
    });
    let blocks = (block(), block(), any::<bool>()).prop_map(|(a, b, cut)| {
        let other = if cut { inverted(b) } else { b };
        with(a, &other)
    });
    prop_oneof![block(), blob, turned, tetrahedra, blocks]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_point_of_every_box_is_inside(solid in solid(), map in map(), most in 1usize..8) {
        checked(&mapped(&solid, map), most);
    }

    #[test]
    fn what_was_a_solid_before_its_corners_were_shaken_has_an_inside_or_has_not(
        solid in solid(),
        shakes in prop::collection::vec((any::<prop::sample::Index>(), vector()), 1..6),
    ) {
        let mut solid = solid;
        for (at, to) in shakes {
            let place = at.index(solid.0.len());
            solid.0[place] = to.as_vec3().as_dvec3();
        }
        checked(&mapped(&solid, glam::DAffine3::IDENTITY), 8);
    }
}

#[test]
fn a_box_is_its_own_inner_box_whichever_way_it_is_turned() {
    for turn in [DVec3::ZERO, DVec3::new(0.3, -1.2, 0.7), DVec3::Z * 0.5] {
        let rotation = glam::DQuat::from_scaled_axis(turn);
        for size in [DVec3::ONE, DVec3::new(10.0, 0.1, 4.0)] {
            let map =
                glam::DAffine3::from_scale_rotation_translation(size, rotation, DVec3::new(3.0, 5.0, -2.0));
            let boxes = checked(&mapped(&cuboid([0.0; 3], [1.0; 3]), map), 8);
            assert_eq!(boxes.len(), 1);
            let share = volume(&boxes[0]) / size.element_product();
            assert!(share > 0.999, "{share} of a box of {size} turned by {turn}");
        }
    }
}

#[test]
fn what_rounding_corners_to_f32_takes_from_a_box_far_away_is_left_out() {
    for far in [1e5, 1e6, 1e7] {
        let away = glam::DAffine3::from_rotation_x(0.3) * glam::DAffine3::from_translation(DVec3::splat(far));
        let boxes = checked(&mapped(&cuboid([0.0; 3], [8.0; 3]), away), 8);
        assert!(boxes.len() == 1 || far > 1e6, "{} boxes at {far}", boxes.len());
    }
    for scale in [1e-44, 1e-40, 1e-37, 1e-20, 1e20, 1e37] {
        let map = glam::DAffine3::from_scale(DVec3::splat(scale));
        let boxes = checked(&mapped(&cuboid([1.0; 3], [4.0; 3]), map), 8);
        assert!(boxes.len() == 1 || scale < 1e-39, "scaled by {scale}");
    }
}

#[test]
fn an_angle_needs_two_boxes_and_a_pillar_of_many_sides_a_few() {
    let angle = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let turn = glam::DAffine3::from_rotation_z(0.4);
    let boxes = checked(&mapped(&extruded(&angle, 2.0, 0), turn), 8);
    let areas: f64 = boxes.iter().map(volume).sum();
    assert_eq!(boxes.len(), 2);
    // The square in the corner belongs to both.
    assert!((areas - 14.0).abs() < 0.05, "{areas}");
    let circle: Vec<[f64; 2]> =
        (0..32).map(|k| f64::from(k) * std::f64::consts::TAU / 32.0).map(|a| [a.cos(), a.sin()]).collect();
    let boxes = checked(&extruded(&circle, 5.0, 0), 8);
    assert!((2..=8).contains(&boxes.len()) && volume(&boxes[0]) > 8.0, "{boxes:?}");
}

#[test]
fn a_shell_has_its_walls_and_its_outer_surface_alone_is_a_solid() {
    let outer = cuboid([0.0; 3], [10.0, 8.0, 3.0]);
    let inner = inverted(cuboid([0.1; 3], [9.9, 7.9, 2.9]));
    let boxes = checked(&with(outer.clone(), &inner), 8);
    assert!(boxes.len() >= 5 && boxes.iter().all(|b| volume(b) < 8.1), "{boxes:?}");
    assert_eq!(checked(&outer, 8).len(), 1);
    assert!(checked(&inner, 8).is_empty());
}

#[test]
fn a_notch_and_a_hole_narrower_than_a_cell_are_not_covered() {
    // A slit from the top almost to the bottom, 10⁻⁴ wide, in a block 2 wide and 1 high.
    for width in [1e-2, 1e-4, 1e-6] {
        let slit = [
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [1.3 + width, 1.0],
            [1.3, 0.01],
            [1.3 - width, 1.0],
            [0.0, 1.0],
        ];
        let boxes = checked(&mapped(&extruded(&slit, 1.0, 4), glam::DAffine3::from_rotation_y(0.2)), 8);
        assert!(boxes.len() >= 2 && boxes.iter().all(|b| volume(b) < 1.4), "{boxes:?}");
    }
    // A needle, inverted, through a block.
    let needle = mapped(&cuboid([0.37, 0.41, -1.0], [0.3701, 0.4101, 2.0]), glam::DAffine3::IDENTITY);
    let bored = with(cuboid([0.0; 3], [1.0; 3]), &inverted(needle.clone()));
    let boxes = checked(&bored, 8);
    assert!(boxes.iter().all(|b| volume(b) < 0.64), "{boxes:?}");
    // A needle that is a spike makes the lattice coarse, not wrong.
    checked(
        &with(cuboid([0.0; 3], [0.01; 3]), &mapped(&needle, glam::DAffine3::from_scale(DVec3::splat(100.0)))),
        8,
    );
}

#[test]
fn what_does_not_close_or_is_no_solid_has_none() {
    let whole = cuboid([0.0; 3], [1.0; 3]);
    let none = |solid: &Solid| inner_boxes(&solid.0, &solid.1, 8).is_empty();
    assert!(!none(&whole));
    assert!(inner_boxes(&whole.0, &whole.1, 0).is_empty());
    assert!(none(&(whole.0.clone(), whole.1[1..].to_vec())));
    let mut turned = whole.clone();
    turned.1[3].swap(0, 1);
    assert!(none(&turned) && none(&inverted(whole.clone())) && none(&(Vec::new(), Vec::new())));
    assert!(none(&(whole.0[..7].to_vec(), whole.1.clone())), "a vertex is missing");
    assert!(none(&mapped(&whole, glam::DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0)))));
    assert!(none(&mapped(&whole, glam::DAffine3::from_scale(DVec3::ZERO))));
    let mut wrong = whole.clone();
    wrong.0[3].x = f64::NAN;
    checked(&whole, 8);
    inner_boxes(&wrong.0, &wrong.1, 8);
}
