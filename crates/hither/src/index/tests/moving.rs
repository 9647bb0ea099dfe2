//! What moves costs what it moves; what rests is left alone.

use super::*;
use glam::{DAffine3, DQuat};
use proptest::prelude::*;

/// `count` nodes with a triangle, of which about a third hang from earlier ones.
fn crowd(count: usize, random: &mut Random) -> Scene {
    let mut scene = Scene::new("crowd");
    scene.meshes = vec![triangle(), Mesh::default()];
    // Depth-first: a parent is the last node or one of those it hangs from.
    let mut open: Vec<u32> = Vec::new();
    for i in 0..count as u32 {
        let keep = random.below(open.len() + 1);
        open.truncate(keep);
        let content = match random.below(8) {
            0 => Content::Nothing,
            1 => Content::Mesh(1),
            _ => Content::Mesh(0),
        };
        let node = Node { parent: open.last().copied(), ..shown(content, random.point(5.0)) };
        scene.groups[0].push(node);
        if random.below(3) > 0 {
            open.push(i);
        }
    }
    scene
}

fn somewhere(random: &mut Random) -> Transform {
    match random.below(6) {
        0 => Transform::default(),
        1 => Transform::Affine(DAffine3::from_scale(DVec3::ZERO)),
        2 => Transform::from_translation(random.point(1e18)),
        3 => Transform::from_translation(random.point(1e-18)),
        _ => Transform::Trs {
            translation: random.point(9.0),
            rotation: DQuat::from_rotation_y(random.unit() * 6.0),
            scale: DVec3::splat(random.unit() * 2.0 - 1.0),
        },
    }
}

/// Slots in use that hold items.
fn items_in(tree: &WideTree) -> Vec<u32> {
    let slots = tree.nodes.iter().flat_map(|n| &n.child[..n.used as usize]);
    let mut items: Vec<u32> = slots
        .filter(|&&s| s != Slot::EMPTY)
        .filter_map(|s| match s.child() {
            Child::Leaf(item) => Some(item),
            Child::Node(_) => None,
        })
        .collect();
    items.sort_unstable();
    items
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_moves_keep_the_trees_sound(seed: u64, count in 1usize..120, moves in 1usize..40) {
        let random = &mut Random(seed);
        let scene = crowd(count, random);
        for tree in KINDS {
            let mut index = SceneIndex::build(scene.clone(), &IndexOptions { tree });
            let mut moved_once = vec![false; count];
            for _ in 0..moves {
                let before = index.groups[0].group_from_content.clone();
                let moved = index.set_transform(random.below(count) as u32, somewhere(random));
                index.validate();
                let group = &index.groups[0];
                let mut elsewhere = 0;
                for (i, item) in group.items.iter().enumerate() {
                    if group.group_from_content[i] != before[i] && item.content == Content::Mesh(0) {
                        elsewhere += 1;
                        moved_once[item.node as usize] = true;
                    }
                }
                prop_assert_eq!(moved, elsewhere);
                for &item in &items_in(&group.resting) {
                    prop_assert!(!moved_once[group.items[item as usize].node as usize]);
                }
            }
        }
    }
}

/// Five hundred things in a hall.
fn hall() -> Scene {
    let mut scene = Scene::new("hall");
    scene.meshes.push(triangle());
    for i in 0..500 {
        scene.groups[0].push(shown(Content::Mesh(0), Random(i).point(50.0)));
    }
    scene
}

#[test]
fn what_rests_is_not_touched() {
    for tree in KINDS {
        let mut index = SceneIndex::build(hall(), &IndexOptions { tree });
        assert_eq!(index.set_transform(7, Transform::from_translation(DVec3::X)), 1);
        let resting = format!("{:?}", index.groups[0].resting);
        for step in 0..100 {
            assert_eq!(index.set_transform(7, Transform::from_translation(DVec3::X * f64::from(step))), 1);
            assert_eq!(items_in(&index.groups[0].moving), [7]);
        }
        assert_eq!(format!("{:?}", index.groups[0].resting), resting);
        assert_eq!(items_in(&index.groups[0].resting).len(), 499);
        assert_eq!(index.set_transform(7, Transform::from_translation(DVec3::X * 99.0)), 0);
    }
}

#[test]
fn what_is_switched_off_costs_nothing_but_its_slot() {
    for tree in KINDS {
        let mut index = SceneIndex::build(hall(), &IndexOptions { tree });
        assert_eq!(index.set_shown(7, false), 1);
        assert_eq!(index.set_shown(7, false), 0);
        assert_eq!(items_in(&index.groups[0].moving), []);
        assert_eq!(items_in(&index.groups[0].resting).len(), 499);
        // It moves all the same, and comes back where it is then.
        assert_eq!(index.set_transform(7, Transform::from_translation(DVec3::X * 80.0)), 0);
        let resting = format!("{:?}", index.groups[0].resting);
        assert_eq!(index.set_shown(7, true), 1);
        assert_eq!(index.set_shown(7, true), 0);
        assert_eq!(items_in(&index.groups[0].moving), [7]);
        assert!(index.groups[0].bounds().max[0] > 80.0);
        assert_eq!(format!("{:?}", index.groups[0].resting), resting);
        // Until nothing is left, and back.
        let all = || 0..500;
        assert_eq!(all().map(|node| index.set_shown(node, false)).sum::<usize>(), 500);
        assert!(index.groups[0].bounds().is_empty());
        assert_eq!(all().map(|node| index.set_shown(node, true)).sum::<usize>(), 500);
        assert_eq!(items_in(&index.groups[0].moving).len(), 500);
    }
}

/// So many triangles, anywhere as far from the origin.
fn swarm(count: u64, reach: f64) -> Scene {
    let mut scene = Scene::new("swarm");
    scene.meshes.push(triangle());
    for i in 0..count {
        scene.groups[0].push(shown(Content::Mesh(0), Random(i).point(reach)));
    }
    scene
}

#[test]
fn a_tree_grown_loose_is_built_anew() {
    let mut index = SceneIndex::build(swarm(64, 1.0), &IndexOptions::default());
    let mut random = Random(9);
    for round in 0..8 {
        for node in 0..64 {
            // All leave, round by round for a place twice as far away, where the tree they had fits badly.
            let at = random.point(2f64.powi(round));
            index.set_transform(node, Transform::from_translation(at));
        }
        let group = &index.groups[0];
        assert!(group.resting.nodes.is_empty());
        assert_eq!(items_in(&group.moving).len(), 64);
    }
}

#[test]
fn a_few_that_come_and_go_leave_a_tree_of_many_as_it_is() {
    let mut index = SceneIndex::build(swarm(700, 100.0), &IndexOptions::default());
    for node in 0..700 {
        index.set_shown(node, false);
    }
    let places = format!("{:?}", index.groups[0].places);
    for node in 0..5 {
        index.set_shown(node * 100, true);
        assert_eq!(items_in(&index.groups[0].moving), [node * 100]);
        assert_eq!(format!("{:?}", index.groups[0].places), places);
        index.set_shown(node * 100, false);
    }
}

/// Half the surface of all boxes of a tree.
fn area(tree: &WideTree) -> f64 {
    let slots = |node: &WideNode| (0..node.used as usize).map(|s| node.bounds_of(s)).collect::<Vec<_>>();
    tree.nodes.iter().flat_map(slots).filter(|b| !b.is_empty()).map(|b| b.half_area()).sum()
}

#[test]
fn a_tree_forgets_what_was_far_away_or_nowhere_for_a_while() {
    let scene = swarm(100, 1.0);
    for away in [3e3, 1e15, 1e30, f64::NAN, f64::INFINITY] {
        let mut index = SceneIndex::build(scene.clone(), &IndexOptions::default());
        let mut random = Random(5);
        let places = |random: &mut Random, far: u32| -> Vec<(u32, Transform)> {
            let place = |n: u32| random.point(100.0) * if n < far { away / 100.0 } else { 1.0 };
            (0..100)
                .map(place)
                .map(Transform::from_translation)
                .enumerate()
                .map(|(n, t)| (n as u32, t))
                .collect()
        };
        for far in [0, 10, 10].into_iter().chain(std::iter::repeat_n(0, 300)) {
            index.set_transforms(places(&mut random, far));
        }
        let mut fresh = SceneIndex::build(scene.clone(), &IndexOptions::default());
        let now = index.scene().root_group().nodes.iter().enumerate().map(|(n, node)| (n as u32, node.local));
        fresh.set_transforms(now);
        let (kept, anew) = (area(&index.groups[0].moving), area(&fresh.groups[0].moving));
        assert!(kept < anew * 1.6, "{away}: {kept}, built anew {anew}");
    }
}

#[test]
fn a_pose_moves_what_its_channels_name_and_what_hangs_from_it() {
    use crate::scene::{Animation, Channel, Interpolation, Property};
    let mut scene = Scene::new("door and handle");
    scene.meshes.push(triangle());
    let root = &mut scene.groups[0];
    root.push(shown(Content::Mesh(0), DVec3::ZERO));
    root.push(Node { parent: Some(0), ..shown(Content::Mesh(0), DVec3::Y) });
    root.push(shown(Content::Mesh(0), DVec3::Z));
    let values = vec![glam::Vec4::ZERO, glam::Vec4::X];
    let channel = Channel {
        node: 0,
        property: Property::Translation,
        interpolation: Interpolation::Linear,
        times: vec![0.0, 1.0],
        values,
    };
    scene.animations.push(Animation { name: String::new(), channels: vec![channel] });
    for tree in KINDS {
        let mut index = SceneIndex::build(scene.clone(), &IndexOptions { tree });
        assert_eq!(index.pose(0, 0.0), 0);
        assert_eq!(index.pose(0, 0.5), 2);
        assert_eq!(index.pose(0, 0.5), 0);
        assert_eq!(index.pose(0, 2.0), 2);
        assert_eq!(index.pose(1, 0.0), 0);
        // What is off is posed, too, and is there when it is switched on again.
        assert_eq!(index.set_shown(0, false), 2);
        assert_eq!(index.pose(0, 0.5), 0);
        assert_eq!(index.set_shown(0, true), 2);
        let half_open = Transform::from_translation(DVec3::X * 0.5);
        assert_eq!(index.scene().root_group().nodes[0].local, half_open);
        index.validate();
    }
}

#[test]
fn transforms_beyond_all_numbers_are_survived() {
    let scene = scene_of(triangle());
    for tree in KINDS {
        let mut index = SceneIndex::build(scene.clone(), &IndexOptions { tree });
        for scale in [1e30, 1e39, 1e300, f64::MAX, 1.0] {
            index.set_transform(0, Transform::Affine(DAffine3::from_scale(DVec3::splat(scale))));
            let far = Transform::from_translation(DVec3::splat(-scale));
            index.set_transform(0, far);
            index.validate();
        }
    }
}
