//! Meshes that lean towards trouble: every tree must be sound on all of them.

use super::*;
use crate::geometry::Aabb;
use proptest::prelude::*;

#[derive(Clone, Copy, Debug)]
enum Trouble {
    Soup,
    Coincident,
    Concentric,
    Slivers,
    Flat,
    OnDividingPlanes,
    Clusters,
    Powers,
    Tiny,
    Huge,
    Extreme,
    Collapsed,
}

const TROUBLE: [Trouble; 12] = [
    Trouble::Soup,
    Trouble::Coincident,
    Trouble::Concentric,
    Trouble::Slivers,
    Trouble::Flat,
    Trouble::OnDividingPlanes,
    Trouble::Clusters,
    Trouble::Powers,
    Trouble::Tiny,
    Trouble::Huge,
    Trouble::Extreme,
    Trouble::Collapsed,
];

fn troubled(kind: Trouble, count: usize, seed: u64) -> Mesh {
    let r = &mut Random(seed);
    let one = [r.point(1.0), r.point(1.0), r.point(1.0)];
    mesh_of((0..count).map(|i| match kind {
        Trouble::Soup => {
            let at = r.point(10.0);
            [at + r.point(0.5), at + r.point(0.5), at + r.point(0.5)]
        }
        Trouble::Coincident => one,
        Trouble::Concentric => {
            let p = r.point(5.0);
            [p, -p, DVec3::new(p.y, -p.x, 0.0)]
        }
        Trouble::Slivers => {
            let (a, b) = (r.point(5.0), r.point(5.0));
            [a, b, a.lerp(b, r.unit()) + r.point(1e-6)]
        }
        Trouble::Flat => [(); 3].map(|()| DVec3::new(r.unit(), 0.5, r.unit())),
        Trouble::OnDividingPlanes => {
            let at = (r.point(8.0)).round() * 0.25;
            [at, at + DVec3::X * 0.25, at + DVec3::new(0.0, 0.25, if i % 2 == 0 { 0.25 } else { 0.0 })]
        }
        Trouble::Clusters => {
            let at = DVec3::splat([0.0, 1.0, 1e7][r.below(3)]);
            [at + r.point(1e-3), at + r.point(1e-3), at + r.point(1e-3)]
        }
        Trouble::Powers => {
            let scale = 2f64.powi(-(r.below(140) as i32));
            [r.point(scale), r.point(scale), r.point(scale)]
        }
        Trouble::Tiny => [r.point(1e-18), r.point(1e-18), r.point(1e-40)],
        Trouble::Huge => [r.point(1e18), r.point(1e18), r.point(1e18)],
        Trouble::Extreme => [r.point(3.4e38), r.point(3.4e38), r.point(1.0)],
        Trouble::Collapsed => {
            let p = r.point(1.0);
            if i % 3 == 0 { [p, p, r.point(1.0)] } else { [p, r.point(1.0), r.point(1.0)] }
        }
    }))
}

#[test]
fn every_tree_is_sound_on_every_kind_of_trouble() {
    for trouble in TROUBLE {
        for count in [0, 1, 2, 15, 16, 17, 40, 300, 1500] {
            for tree in KINDS {
                let scene = scene_of(troubled(trouble, count, count as u64));
                SceneIndex::build(scene, &IndexOptions { tree }).validate();
            }
        }
    }
}

#[test]
fn leaves_are_not_mostly_empty() {
    for tree in [TreeKind::Bvh, TreeKind::OctreeSmallest] {
        let index = SceneIndex::build(scene_of(troubled(Trouble::Soup, 5000, 7)), &IndexOptions { tree });
        let solid = &index.meshes[0].solid;
        assert!(solid.blocks.len() < 5000 / 6, "{tree:?}: {} leaves", solid.blocks.len());
        assert!(
            solid.tree.nodes.len() < solid.blocks.len() / 3,
            "{tree:?}: {} nodes",
            solid.tree.nodes.len()
        );
    }
}

#[test]
fn copies_are_not_multiplied_without_end() {
    let mesh = troubled(Trouble::Coincident, 20_000, 3);
    let index = SceneIndex::build(scene_of(mesh), &IndexOptions { tree: TreeKind::OctreePushed });
    let lanes: u32 = index.meshes[0].solid.blocks.iter().map(|b| b.lanes.count_ones()).sum();
    assert!(lanes <= 8 * 20_000, "{lanes} lanes for 20,000 triangles");
}

/// A pushed-down triangle may lie in several leaves, but every one of them has a box around all of it: who
/// finds one of them hidden may skip the triangle.
#[test]
fn every_leaf_that_lists_a_triangle_encloses_it() {
    for trouble in TROUBLE {
        let mesh = troubled(trouble, 700, 11);
        let index = SceneIndex::build(scene_of(mesh), &IndexOptions { tree: TreeKind::OctreePushed });
        let (solid, mesh) = (&index.meshes[0].solid, &index.scene().meshes[0]);
        for node in &solid.tree.nodes {
            for slot in 0..node.used as usize {
                let Child::Leaf(leaf) = node.child[slot].child() else { continue };
                let block = &solid.blocks[leaf as usize];
                for lane in (0..16).filter(|l| block.lanes >> l & 1 == 1) {
                    let corners = mesh.triangles[block.triangle[lane] as usize];
                    let corners = corners.map(|v| mesh.positions[v as usize].as_dvec3());
                    let bounds = Aabb::around(corners);
                    let outer = node.bounds_of(slot).to_aabb();
                    assert!(outer.contains(bounds.min) && outer.contains(bounds.max));
                }
            }
        }
    }
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    for (trouble, count) in [(Trouble::Soup, 150_000), (Trouble::Coincident, 20_000)] {
        for tree in KINDS {
            let build = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let scene = scene_of(troubled(trouble, count, 5));
                trees(&pool.install(|| SceneIndex::build(scene, &IndexOptions { tree })))
            };
            assert!(build(1) == build(3), "{tree:?}, {trouble:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn mixed_trouble_is_indexed_soundly(
        parts in prop::collection::vec((0..TROUBLE.len(), 0usize..60), 1..5),
        seed: u64,
    ) {
        let mut mixed = Mesh::default();
        for (kind, count) in parts {
            let part = troubled(TROUBLE[kind], count, seed);
            let first = mixed.positions.len() as u32;
            mixed.positions.extend(&part.positions);
            mixed.triangles.extend(part.triangles.iter().map(|t| t.map(|v| first + v)));
        }
        mixed.primitives.push(Primitive { triangles: 0..mixed.triangles.len() as u32, material: None });
        for tree in KINDS {
            SceneIndex::build(scene_of(mixed.clone()), &IndexOptions { tree }).validate();
        }
    }
}
