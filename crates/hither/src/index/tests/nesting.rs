//! Worlds that nest: deep, and wide without being stored wide.

use super::*;

#[test]
fn ten_thousand_nodes_hang_from_each_other() {
    const DEPTH: u32 = 10_000;
    let mut scene = Scene::new("chain");
    scene.meshes.push(triangle());
    for i in 0..DEPTH {
        let node = shown(Content::Mesh(0), DVec3::X);
        scene.groups[0].push(Node { parent: i.checked_sub(1), ..node });
    }
    for tree in KINDS {
        let mut index = SceneIndex::build(scene.clone(), &IndexOptions { tree });
        assert_eq!(index.set_transform(0, Transform::from_translation(DVec3::Y)), DEPTH as usize);
        assert_eq!(index.set_transform(DEPTH - 1, Transform::from_translation(DVec3::Y)), 1);
        index.validate();
    }
}

#[test]
fn ten_thousand_groups_nest() {
    let mut scene = scene_of(triangle());
    for g in 0..9_999 {
        let mut group = Group::default();
        group.push(shown(Content::Group(g), DVec3::X));
        scene.groups.push(group);
    }
    scene.root = 9_999;
    for tree in KINDS {
        let index = SceneIndex::build(scene.clone(), &IndexOptions { tree });
        let bounds = index.groups[9_999].bounds();
        assert!(bounds.contains(DVec3::X * 9_999.0) && bounds.contains(DVec3::new(10_000.0, 1.0, 0.0)));
    }
}

/// 33×33×33 modules as rows of modules, storeys of rows, a building of storeys.
#[test]
fn a_nested_building_takes_little_memory() {
    const SIDE: usize = 33;
    let mut scene = scene_of(mesh_of((0..1000).map(|i| {
        let at = Random(i).point(0.5);
        [at, at + DVec3::X * 0.01, at + DVec3::Y * 0.01]
    })));
    for (g, axis) in [DVec3::X, DVec3::Z, DVec3::Y].into_iter().enumerate() {
        let mut group = Group::default();
        for i in 0..SIDE {
            group.push(shown(Content::Group(g as u32), axis * i as f64));
        }
        scene.groups.push(group);
    }
    scene.root = 3;
    assert_eq!(scene.instance_count(), 35_937);
    for tree in KINDS {
        let index = SceneIndex::build(scene.clone(), &IndexOptions { tree });
        let module: usize = index.meshes.iter().map(MeshIndex::memory_bytes).sum();
        assert!(index.memory_bytes() - module < 100_000, "{} bytes", index.memory_bytes() - module);
    }
}

/// Small things in a country's coordinates, in a group of their own or not, at rest or moved; one is lost far away.
#[test]
fn what_lies_together_far_away_has_tight_boxes() {
    let far = DVec3::new(512_345.6, 30.0, -5_412_345.7);
    let mut town = Group::default();
    for i in 0..300 {
        town.push(shown(Content::Mesh(0), far + Random(i).point(50.0)));
    }
    town.push(shown(Content::Mesh(0), DVec3::new(1e9, 0.0, 3e12)));
    let mut scene = scene_of(mesh_of([[DVec3::ZERO, DVec3::X * 0.01, DVec3::Y * 0.01]]));
    scene.groups.push(town);
    scene.root = 1;
    for tree in KINDS {
        let mut index = SceneIndex::build(scene.clone(), &IndexOptions { tree });
        index.validate();
        let looseness = |index: &SceneIndex| {
            let group = &index.groups[1];
            let nodes = group.resting.nodes.iter().chain(&group.moving.nodes);
            let slots = nodes.flat_map(|node| (0..node.used as usize).map(move |slot| (node, slot)));
            let leaves = slots.filter(|(node, slot)| {
                node.child[*slot] != Slot::EMPTY && matches!(node.child[*slot].child(), Child::Leaf(_))
            });
            let mut sizes: Vec<f64> =
                leaves.map(|(node, slot)| node.bounds_of(slot).to_aabb().size().max_element()).collect();
            assert_eq!(sizes.len(), 301);
            sizes.sort_by(f64::total_cmp);
            sizes[299]
        };
        assert!(looseness(&index) < 0.0101, "{tree:?}: {}", looseness(&index));
        for node in 0..100 {
            let at = far + Random(u64::from(node) + 1000).point(50.0);
            index.set_transform(node, Transform::from_translation(at));
        }
        assert!(looseness(&index) < 0.0101, "{tree:?}, moved: {}", looseness(&index));
        let bounds = index.groups[1].bounds();
        assert!(bounds.contains(far) && bounds.contains(DVec3::new(1e9, 0.0, 3e12)));
        // All of it comes to the origin, as the worlds of games do that move with the eye, and goes back.
        for origin in [DVec3::ZERO, far] {
            let place = |node: u32| origin + Random(u64::from(node)).point(50.0);
            let all = (0..301).map(|node| (node, Transform::from_translation(place(node))));
            index.set_transforms(all);
            assert!(looseness(&index) < 0.0101, "{tree:?}, {origin}: {}", looseness(&index));
        }
    }
}
