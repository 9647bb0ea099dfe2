//! The sort against brute force: every pair, every group, over random motion.

use super::*;
use crate::geometry::Hull;
use crate::reference::{ivs, occlusion};
use glam::{DAffine3, DQuat, DVec3};
use proptest::prelude::*;

/// Gaps below this share of the scene's size are neither here nor there.
const DOUBT: f64 = 1e-7;

/// A small linear congruential generator.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    fn pose(&mut self, spread: f64) -> DAffine3 {
        let axis = self.vector().normalize_or(DVec3::X);
        let turn = DQuat::from_axis_angle(axis, self.unit() * 6.0);
        DAffine3::from_rotation_translation(turn, self.vector() * spread)
    }
}

/// A few shapes: boxes long and cubic, tetrahedra, flat ones, needles, a point.
fn shape(random: &mut Random) -> Vec<DVec3> {
    let half = match (random.unit() * 7.0) as u32 {
        0 => DVec3::new(1.5, 0.1, 0.1),
        1 => DVec3::splat(0.4),
        2 => DVec3::new(1.0, 1.0, 0.0),
        3 => DVec3::new(0.5, 0.5, 1e-9),
        4 => return (0..4).map(|_| random.vector()).collect(),
        5 => return vec![random.vector(), random.vector()],
        _ => DVec3::new(0.9, 0.2, 0.4),
    };
    (0..8)
        .map(|i| half * DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - half)
        .collect()
}

/// A sort and beside it the bare points, for brute force.
struct Stage {
    sort: VisibilitySort,
    shapes: Vec<Vec<Vec<DVec3>>>,
    poses: Vec<Vec<DAffine3>>,
    shown: Vec<bool>,
}

impl Stage {
    fn new(options: SortOptions) -> Stage {
        Stage { sort: VisibilitySort::new(options), shapes: vec![], poses: vec![], shown: vec![] }
    }

    fn add(&mut self, random: &mut Random, spread: f64) {
        let pieces = if random.unit() < 0.2 { 2 } else { 1 };
        let shapes: Vec<Vec<DVec3>> = (0..pieces).map(|_| shape(random)).collect();
        let hulls: Vec<u32> = shapes.iter().map(|s| self.sort.add_hull(Hull::around(s).unwrap())).collect();
        self.sort.add_part(&hulls);
        let whole = random.pose(spread);
        self.poses.push(shapes.iter().map(|_| whole * random.pose(0.5)).collect());
        self.shapes.push(shapes);
        self.shown.push(true);
    }

    fn place(&mut self) {
        let mut piece = 0;
        for poses in &self.poses {
            for pose in poses {
                self.sort.place(piece, *pose);
                piece += 1;
            }
        }
        for (part, &shown) in self.shown.iter().enumerate() {
            self.sort.show(part as u32, shown);
        }
    }

    /// Sorts and checks; returns whether there was any doubt.
    fn check(&mut self, eye: DVec3) -> bool {
        self.place();
        self.sort.sort(eye);
        let shown: Vec<usize> = (0..self.shown.len()).filter(|&p| self.shown[p]).collect();
        let points = |part: usize| -> Vec<Vec<DVec3>> {
            let placed = self.shapes[part].iter().zip(&self.poses[part]);
            placed.map(|(s, pose)| s.iter().map(|&p| pose.transform_point3(p) - eye).collect()).collect()
        };
        let bodies: Vec<Vec<Vec<DVec3>>> = (0..self.shown.len()).map(points).collect();
        let gap = |front: usize, behind: usize| {
            let pairs = bodies[front].iter().flat_map(|f| bodies[behind].iter().map(move |b| (f, b)));
            pairs.map(|(f, b)| occlusion::gap(f, b)).fold(f64::INFINITY, f64::min)
        };
        let (mut arcs, mut doubt) = (Vec::new(), false);
        for &a in &shown {
            for &b in shown.iter().filter(|&&b| b != a) {
                let gap = gap(a, b);
                doubt |= gap.abs() < DOUBT;
                if gap < -DOUBT {
                    arcs.push((a as u32, b as u32));
                }
            }
        }
        let groups: Vec<Vec<u32>> = self.sort.order().groups().map(<[u32]>::to_vec).collect();
        let mut all: Vec<u32> = groups.concat();
        all.sort_unstable();
        assert_eq!(all, shown.iter().map(|&p| p as u32).collect::<Vec<_>>());
        let place = |part: u32| groups.iter().position(|g| g.contains(&part)).unwrap();
        for &(front, behind) in &arcs {
            assert!(place(front) <= place(behind), "{front} occludes {behind} and comes later");
        }
        if !doubt {
            let mut sorted = groups.clone();
            sorted.iter_mut().for_each(|g| g.sort_unstable());
            sorted.sort();
            let mut expected = occlusion::components(self.shown.len(), &arcs);
            expected.retain(|g| self.shown[g[0] as usize]);
            assert_eq!(sorted, expected);
            assert_eq!(self.sort.arcs(), arcs);
            assert_eq!(self.sort.arcs_among(&all), arcs);
            for (a, b) in self.sort.intersecting_pairs() {
                assert!(arcs.contains(&(a, b)) && arcs.contains(&(b, a)));
            }
        }
        doubt
    }
}

fn perform(seed: u64, frames: usize, spread: f64, options: SortOptions) -> usize {
    let mut random = Random(seed);
    let mut stage = Stage::new(options);
    if seed.is_multiple_of(4) {
        let (x, y) = (DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.8, 0.6, 0.0));
        let angle = Direction::Angular { zero: x, positive: y };
        stage.sort.set_directions(&[
            Direction::Spatial(y),
            angle,
            Direction::Spatial(DVec3::Z),
            Direction::Spatial(x),
        ]);
    }
    for _ in 0..3 + (random.unit() * 8.0) as usize {
        stage.add(&mut random, spread);
    }
    let mut eye = random.vector() * spread;
    let mut doubts = 0;
    for _ in 0..frames {
        doubts += usize::from(stage.check(eye));
        match (random.unit() * 10.0) as u32 {
            0 => eye = random.vector() * spread,
            1 if stage.shown.len() < 14 => stage.add(&mut random, spread),
            2 | 3 => {
                let part = (random.unit() * stage.shown.len() as f64) as usize;
                stage.shown[part] = !stage.shown[part];
            }
            4 => stage.poses.iter_mut().flatten().for_each(|p| *p = random.pose(spread)),
            _ => {
                eye += random.vector() * 0.1;
                for pose in stage.poses.iter_mut().flatten() {
                    *pose *= random.pose(0.02);
                }
            }
        }
    }
    doubts
}

#[test]
fn order_and_groups_are_those_of_brute_force_over_motion_jumps_insertions_and_removals() {
    let phases = [BroadPhase::Grids, BroadPhase::KdTree, BroadPhase::Depth];
    let mut doubts = 0;
    for seed in 0..60 {
        let options = SortOptions {
            conditioning: seed % 3 != 0,
            incremental: seed % 5 != 0,
            broad_phase: phases[seed as usize % 7 % 3],
            ..SortOptions::default()
        };
        doubts += perform(seed, 25, [1.0, 2.0, 5.0, 20.0][seed as usize % 4], options);
    }
    assert!(doubts < 20, "{doubts} of 1,500 frames were in doubt");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn any_motion_sorts(seed: u64) {
        perform(seed, 12, 2.5, SortOptions::default());
    }
}

/// Three long boxes in a ring, each over the next, seen from above; and what lies far behind.
fn ring() -> VisibilitySort {
    let mut sort = VisibilitySort::new(SortOptions::default());
    let half = DVec3::new(1.6, 0.1, 0.3);
    let corners: Vec<DVec3> = (0..8)
        .map(|i| half * (DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0))
        .collect();
    let hull = sort.add_hull(Hull::around(&corners).unwrap());
    for i in 0..3 {
        let part = sort.add_part(&[hull]);
        let turn = DAffine3::from_rotation_y(f64::from(i) * 120f64.to_radians());
        let tilt = DAffine3::from_rotation_z(0.3);
        sort.place(part, turn * DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.8)) * tilt);
    }
    sort
}

#[test]
fn figure_2c_is_one_group_without_mutual_occluders() {
    let mut sort = ring();
    let eye = DVec3::new(0.0, 30.0, 0.0);
    let groups: Vec<usize> = sort.sort(eye).groups().map(<[u32]>::len).collect();
    assert_eq!(groups, [3]);
    let arcs = sort.arcs();
    assert_eq!(arcs.len(), 3, "{arcs:?}");
    assert!(arcs.iter().all(|&(a, b)| !arcs.contains(&(b, a))));
    assert!(sort.intersecting_pairs().is_empty());
}

#[test]
fn figure_13_a_group_does_not_grow_through_the_space_between_its_members() {
    let mut sort = VisibilitySort::new(SortOptions::default());
    let cube: Vec<DVec3> = (0..8)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5)
        .collect();
    let hull = sort.add_hull(Hull::around(&cube).unwrap());
    let at = |scale: [f64; 3], center: [f64; 3]| {
        DAffine3::from_scale_rotation_translation(scale.into(), DQuat::IDENTITY, center.into())
    };
    // Two bars that meet in a corner, and before the opening of their angle a small cube. A box around both bars
    // would be occluded by it.
    let bars = [at([8.0, 1.0, 1.0], [0.0, -3.5, -14.0]), at([1.0, 8.0, 1.0], [-3.5, 0.0, -14.0])];
    for pose in bars.into_iter().chain([at([0.3, 0.3, 0.3], [0.8, 0.8, -6.0])]) {
        let part = sort.add_part(&[hull]);
        sort.place(part, pose);
    }
    let groups: Vec<Vec<u32>> = sort.sort(DVec3::ZERO).groups().map(<[u32]>::to_vec).collect();
    assert_eq!(groups, [vec![2], vec![0, 1]]);
}

#[test]
fn figures_6_and_7_end_in_the_same_order_whatever_the_start() {
    let arcs = [(0u32, 1u32), (0, 2), (1, 2)];
    for start in [[0, 1, 2], [2, 1, 0], [1, 0, 2], [2, 0, 1]] {
        let sorted = ivs::sort(&start, false, |a, b| arcs.contains(&(a, b)));
        assert_eq!(sorted.groups, [[0], [1], [2]]);
    }
}

#[test]
fn odd_parts_have_defined_answers() {
    let mut sort = VisibilitySort::new(SortOptions::default());
    assert_eq!(sort.sort(DVec3::ZERO).parts(), [0u32; 0]);
    let cube: Vec<DVec3> = (0..8)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5)
        .collect();
    let hull = sort.add_hull(Hull::around(&cube).unwrap());
    // Without pieces, around the eye, two copies at one place, one that is nowhere.
    sort.add_part(&[]);
    for z in [0.0, -5.0, -5.0, f64::NAN] {
        let part = sort.add_part(&[hull]);
        sort.place(part - 1, DAffine3::from_translation(DVec3::new(0.0, 0.0, z)));
    }
    let groups: Vec<Vec<u32>> = sort.sort(DVec3::ZERO).groups().map(<[u32]>::to_vec).collect();
    let with = |part: u32| groups.iter().find(|g| g.contains(&part)).cloned();
    assert_eq!(with(0), Some(vec![0]));
    assert_eq!(with(1), Some(vec![1]));
    assert_eq!(with(2), Some(vec![2, 3]));
    assert_eq!(with(4), None);
    assert_eq!(sort.intersecting_pairs(), [(2, 3)]);
    assert!(sort.sort(DVec3::NAN).parts().is_empty());
    assert_eq!(sort.sort(DVec3::ZERO).parts().len(), 4);
}

#[test]
fn a_backdrop_around_everything_comes_last() {
    let mut sort = VisibilitySort::new(SortOptions::default());
    let cube: Vec<DVec3> = (0..8)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5)
        .collect();
    let hull = sort.add_hull(Hull::around(&cube).unwrap());
    for scale in [100.0, 1.0, 1.0] {
        let part = sort.add_part(&[hull]);
        let at = DVec3::new(0.0, 0.0, -3.0 * f64::from(part));
        sort.place(part, DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, at));
    }
    assert_eq!(sort.sort(DVec3::ZERO).groups().count(), 1);
    sort.set_backdrop(0, true);
    for _ in 0..2 {
        let groups: Vec<Vec<u32>> = sort.sort(DVec3::ZERO).groups().map(<[u32]>::to_vec).collect();
        assert_eq!(groups, [[1], [2], [0]]);
    }
}

#[test]
fn a_known_plane_parts_neighbours_that_overlap() {
    let mut sort = VisibilitySort::new(SortOptions::default());
    let cube: Vec<DVec3> = (0..8)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5)
        .collect();
    let hull = sort.add_hull(Hull::around(&cube).unwrap());
    for x in [0.0, 0.9] {
        let part = sort.add_part(&[hull]);
        sort.place(part, DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)));
    }
    let eye = DVec3::new(5.0, 0.2, 0.1);
    assert_eq!(sort.sort(eye).groups().count(), 1);
    sort.know(0, 1, Known::Plane { normal: DVec3::X, offset: 0.45 });
    let groups: Vec<Vec<u32>> = sort.sort(eye).groups().map(<[u32]>::to_vec).collect();
    assert_eq!(groups, [[1], [0]]);
    let groups: Vec<Vec<u32>> = sort.sort(-eye).groups().map(<[u32]>::to_vec).collect();
    assert_eq!(groups, [[0], [1]]);
}

/// Parts that leave their places make the tree worse and worse: it is built anew in the background, and every order on
/// the way is the same whenever the thread is done.
#[test]
fn a_tree_built_in_the_background_changes_no_order() {
    let run = |pause: bool| {
        let mut random = Random(5);
        let options = SortOptions { broad_phase: BroadPhase::KdTree, ..SortOptions::default() };
        let mut stage = Stage::new(options);
        stage.sort.set_directions(&[Direction::Spatial(DVec3::X), Direction::Spatial(DVec3::Z)]);
        (0..80).for_each(|_| stage.add(&mut random, 1.0));
        let mut orders = Vec::new();
        for frame in 0..60 {
            // From side by side to one behind the other.
            let turn = DQuat::from_rotation_y(f64::from(frame.min(40)) * 0.039);
            for (poses, i) in stage.poses.iter_mut().zip(0..) {
                let place = turn * DVec3::new(f64::from(i) * 2.0, 0.0, -1.0) + DVec3::NEG_Z * 5.0;
                poses.iter_mut().for_each(|p| p.translation = place);
            }
            stage.place();
            orders.push(stage.sort.sort(DVec3::new(0.0, 0.0, 3.0)).clone());
            if pause && frame % 7 == 0 {
                std::thread::sleep(std::time::Duration::from_millis(5));
            }
        }
        (orders, stage.sort.tree_builds())
    };
    let (orders, builds) = run(false);
    assert!(builds > 1, "{builds}");
    assert!(run(true) == (orders, builds));
}
