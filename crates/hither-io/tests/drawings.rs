//! Drawings kept as pictures, of what line drawing programs get wrong: bodies that pass through each other,
//! share faces, and stand on each other. `HITHER_BLESS=1 cargo test -p hither-io --test drawings` makes the
//! pictures anew; look at them before they are kept.

use glam::{DVec2, DVec3, Vec3};
use hither::Scene;
use hither::hidden_line::views::Direction;
use hither::hidden_line::{FaceColor, LineOptions, Preparation, PrepareOptions};
use hither::scene::{Content, Mesh, Node, Primitive};
use hither_io::{Sheet, SheetView, Unit, write_svg};
use std::path::Path;

fn add_box(scene: &mut Scene, name: &str, min: [f32; 3], max: [f32; 3]) {
    let pick = |k: usize, axis: usize| if k >> axis & 1 == 0 { min[axis] } else { max[axis] };
    let quads = [[0u32, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    scene.meshes.push(Mesh {
        positions: (0..8).map(|k| Vec3::new(pick(k, 0), pick(k, 1), pick(k, 2))).collect(),
        triangles: quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect(),
        primitives: vec![Primitive { triangles: 0..12, material: None }],
        ..Mesh::default()
    });
    let content = Content::Mesh(scene.meshes.len() as u32 - 1);
    scene.groups[0].push(Node { name: name.into(), content, ..Node::default() });
}

fn pierced() -> Scene {
    let mut scene = Scene::new("pierced");
    add_box(&mut scene, "cube", [0.0; 3], [1.0; 3]);
    add_box(&mut scene, "bar", [-0.3, 0.3, 0.3], [1.3, 0.7, 0.7]);
    scene
}

fn nested() -> Scene {
    let mut scene = Scene::new("nested");
    add_box(&mut scene, "outer", [0.0; 3], [2.0; 3]);
    add_box(&mut scene, "flush", [0.0, 0.0, 0.0], [1.0, 1.0, 2.0]);
    add_box(&mut scene, "on top", [0.0, 2.0, 0.0], [1.0, 3.0, 1.0]);
    add_box(&mut scene, "beside", [2.0, 0.0, 0.5], [3.0, 2.0, 1.5]);
    scene
}

/// Three floors of slabs on walls and columns, with lintels.
fn building() -> Scene {
    let mut scene = Scene::new("building");
    for floor in 0..3 {
        let y = floor as f32 * 3.0;
        add_box(&mut scene, "slab", [0.0, y, 0.0], [8.0, y + 0.3, 6.0]);
        add_box(&mut scene, "wall", [0.0, y + 0.3, 0.0], [8.0, y + 3.0, 0.3]);
        add_box(&mut scene, "wall", [0.0, y + 0.3, 0.3], [0.3, y + 3.0, 6.0]);
        for x in [2.5, 5.0, 7.6] {
            add_box(&mut scene, "column", [x, y + 0.3, 5.6], [x + 0.4, y + 2.6, 6.0]);
        }
        add_box(&mut scene, "lintel", [0.3, y + 2.6, 5.6], [8.0, y + 3.0, 6.0]);
    }
    add_box(&mut scene, "roof", [-0.5, 9.0, -0.5], [8.5, 9.3, 6.5]);
    scene
}

fn check(scene: &Scene) {
    let direction = Direction { backward: DVec3::new(3.0, 2.2, 5.0), up: DVec3::Y };
    let bounds = scene.bounds().unwrap();
    let view = direction.view(&bounds, 400.0 / direction.extent(&bounds).max_element(), 5);
    let options = LineOptions { hidden: true, faces: Some(FaceColor::Flat), ..LineOptions::default() };
    let drawing = Preparation::new(scene, &PrepareOptions::default()).draw(&view, &options).unwrap();
    let names: Vec<String> = scene.instances().iter().map(|i| scene.path_name(&i.path)).collect();
    let sheet = Sheet {
        title: &scene.name,
        width: drawing.width,
        height: drawing.height,
        unit: Unit::Pixel,
        views: vec![SheetView { name: String::new(), drawing: &drawing, origin: DVec2::ZERO, scale: 1.0 }],
        part_names: &names,
        style: "",
    };
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/goldens/{}.svg", scene.name));
    if std::env::var_os("HITHER_BLESS").is_some() {
        write_svg(&kept, &sheet).unwrap();
    }
    let fresh = std::env::temp_dir().join(format!("hither-golden-{}-{}.svg", scene.name, std::process::id()));
    write_svg(&fresh, &sheet).unwrap();
    let (a, b) = (std::fs::read_to_string(&fresh).unwrap(), std::fs::read_to_string(&kept).unwrap());
    assert!(a == b, "{} differs from {}", fresh.display(), kept.display());
    std::fs::remove_file(fresh).unwrap();
}

#[test]
fn drawings_are_as_they_were_kept() {
    for scene in [pierced(), nested(), building()] {
        check(&scene);
    }
}
