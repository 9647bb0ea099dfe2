//! From a PLY file's rows to a mesh: indices checked, polygons cut, unused vertices left out.

use super::rows::Rows;
use crate::oddities::{Losses, Oddities};
use crate::polygon::{Fit, Triangulator, doubled_area};
use glam::Vec3;
use hither::scene::{AlphaMode, Content, Material, Mesh, Node, Primitive, Scene};

/// Makes a scene of one mesh, or of none if there is no triangle. Faces of which none can be drawn are refused.
pub(super) fn build(rows: Rows, oddities: &mut Oddities) -> Result<Scene, String> {
    let mut scene = Scene::new("");
    let mut losses = Losses::default();
    let triangles = triangles(&rows, &mut losses, oddities);
    if triangles.is_empty() {
        return losses.refusal("face").map_or(Ok(scene), Err);
    }
    let mut mesh = Mesh {
        positions: rows.positions,
        normals: rows.normals,
        uvs: rows.uvs,
        colors: rows.colors,
        primitives: vec![Primitive { triangles: 0..triangles.len() as u32, material: Some(0) }],
        triangles,
        ..Mesh::default()
    };
    drop_unused_vertices(&mut mesh);
    mend_normals(&mut mesh);
    // Where nothing at all would be seen, the alpha channel means something else.
    let translucent = mesh.colors.iter().any(|c| c.w < 1.0) && mesh.colors.iter().any(|c| c.w > 0.0);
    let alpha = if translucent { AlphaMode::Blend } else { AlphaMode::Opaque };
    scene.materials.push(Material { double_sided: true, alpha, ..Material::default() });
    scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
    scene.meshes.push(mesh);
    Ok(scene)
}

fn triangles(rows: &Rows, losses: &mut Losses, oddities: &mut Oddities) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(rows.face_ends.len());
    let mut triangulator = Triangulator::default();
    let (mut outline, mut cut) = (Vec::new(), Vec::new());
    let mut start = 0;
    for (face, &end) in rows.face_ends.iter().enumerate() {
        let corners = &rows.corners[start..end as usize];
        start = end as usize;
        let place = || format!("face {face}");
        let mut note = |kind: &'static str| oddities.note(kind, place, || kind.to_owned());
        let mut lose = |kind: &'static str| {
            losses.lost(face as u64, kind);
            note(kind);
        };
        outline.clear();
        outline.extend(corners.iter().map_while(|&c| rows.positions.get(c as usize).copied()));
        if outline.len() < corners.len() {
            lose("a face names a vertex that does not exist and is left out");
            continue;
        }
        if corners.len() < 3 {
            lose("a face has fewer than three corners and is left out");
            continue;
        }
        if !outline.iter().all(|p| p.is_finite()) {
            match outline.iter().any(|p| p.is_nan()) {
                true => lose("a face has a coordinate that is no number and is left out"),
                false => {
                    lose("a face has a coordinate that is infinite or beyond 32-bit floats and is left out")
                }
            }
            continue;
        }
        cut.clear();
        match triangulator.triangulate(&outline, &mut cut) {
            Fit::TooIntricate => {
                lose("the outline of a face is too intricate; it is left out");
                continue;
            }
            Fit::Exact if cut.is_empty() => note("a face without area is left out"),
            Fit::Exact => {}
            Fit::CrossesItself => note("the outline of a face crosses itself; its triangles are a guess"),
        }
        losses.understood();
        triangles.extend(cut.iter().map(|t| t.map(|i| corners[i as usize])));
    }
    triangles
}

/// Leaves out the vertices that no triangle uses, among them those whose position is no number.
fn drop_unused_vertices(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    for &corner in mesh.triangles.as_flattened() {
        used[corner as usize] = true;
    }
    if used.iter().all(|&u| u) {
        return;
    }
    let mut next = 0;
    let renumbered: Vec<u32> = used
        .iter()
        .map(|&u| {
            let number = next;
            next += u32::from(u);
            number
        })
        .collect();
    for corner in mesh.triangles.as_flattened_mut() {
        *corner = renumbered[*corner as usize];
    }
    keep(&mut mesh.positions, &used);
    keep(&mut mesh.normals, &used);
    keep(&mut mesh.uvs, &used);
    keep(&mut mesh.colors, &used);
}

fn keep<T>(list: &mut Vec<T>, wanted: &[bool]) {
    let mut wanted = wanted.iter();
    list.retain(|_| wanted.next() == Some(&true));
}

/// Gives vertices without a normal that of their first face.
fn mend_normals(mesh: &mut Mesh) {
    if mesh.normals.iter().all(|&n| n == Vec3::ZERO) {
        mesh.normals.clear();
        return;
    }
    for triangle in &mesh.triangles {
        for &corner in triangle {
            if mesh.normals[corner as usize] == Vec3::ZERO {
                let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
                mesh.normals[corner as usize] = doubled_area(a, b, c).normalize_or_zero().as_vec3();
            }
        }
    }
}
