//! Nodes that are switched off and on again, until none is left and back: what is drawn is what a plain z-buffer draws.

use glam::{DVec3, Vec3};
use hither::conventions::{Projection, View};
use hither::cull::{CullOptions, cull};
use hither::index::TreeKind;
use hither::reference::trouble::Random;
use hither::scene::{Content, Mesh, Node, Primitive, Scene, Transform};
use hither::{Algorithm, IndexOptions, RenderOptions, SceneIndex, render};

#[test]
fn both_algorithms_draw_what_is_left() {
    for tree in [TreeKind::Bvh, TreeKind::OctreeSmallest, TreeKind::OctreePushed] {
        let random = &mut Random::new(8);
        let mut scene = Scene::new("hall");
        scene.meshes.push(Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            primitives: vec![Primitive { triangles: 0..1, material: None }],
            ..Mesh::default()
        });
        for _ in 0..300 {
            let local = Transform::from_translation(random.point(4.0));
            scene.groups[0].push(Node { content: Content::Mesh(0), local, ..Node::default() });
        }
        let mut index = SceneIndex::build(scene, &IndexOptions { tree });
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        let view = View::look_at(DVec3::Z * 9.0, DVec3::ZERO, DVec3::Y, projection, (90, 70));
        for round in 0..12 {
            for node in 0..300 {
                index.set_shown(node, round % 4 != 3 && random.below(4) < round % 5);
            }
            let plain = RenderOptions { algorithm: Algorithm::ZBuffer, ..RenderOptions::default() };
            let plain = render(&index, &view, &plain).unwrap();
            let frame = render(&index, &view, &RenderOptions::default()).unwrap();
            let found = cull(&index, &view, &CullOptions::default()).unwrap().visible;
            for (x, y) in (0..70).flat_map(|y| (0..90).map(move |x| (x, y))) {
                assert_eq!(frame.id(x, y), plain.id(x, y), "{tree:?}, round {round}: ({x}, {y})");
                assert!(frame.id(x, y).is_none_or(|id| found.contains(&id.instance)), "round {round}");
            }
            let is_empty = round % 4 == 3 || round % 5 == 0;
            assert_eq!(found.is_empty(), is_empty, "{tree:?}, round {round}");
        }
    }
}
