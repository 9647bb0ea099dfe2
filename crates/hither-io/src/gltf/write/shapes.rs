//! Meshes and cameras as they are written.

use super::binary::{Binary, Purpose, Use};
use super::document::{Attributes, CameraEntry, Lens, MeshEntry, Orthographic, Perspective, PrimitiveEntry};
use super::expand::Expanded;
use super::looks::Looks;
use glam::Vec3;
use hither::scene::{CameraProjection, Mesh, Scene};

/// The meshes that are shown and have triangles or lines, and which of the scene's became which.
pub(super) fn meshes<'a>(
    scene: &'a Scene,
    expanded: &Expanded,
    looks: &mut Looks,
    binary: &mut Binary,
) -> (Vec<MeshEntry<'a>>, Vec<Option<u32>>) {
    let mut entries = Vec::new();
    let shown = expanded.shown_meshes(scene.meshes.len());
    let index = scene
        .meshes
        .iter()
        .zip(shown)
        .map(|(mesh, shown)| {
            if !shown || (mesh.triangles.is_empty() && mesh.lines.is_empty()) {
                return None;
            }
            entries.push(entry(mesh, looks, binary));
            Some((entries.len() - 1) as u32)
        })
        .collect();
    (entries, index)
}

fn entry<'a>(mesh: &'a Mesh, looks: &mut Looks, binary: &mut Binary) -> MeshEntry<'a> {
    let mut primitives = match mesh.triangles.is_empty() {
        true => Vec::new(),
        false => faces(mesh, looks, binary),
    };
    if !mesh.lines.is_empty() {
        const LINES: u32 = 1;
        let ends = mesh.lines.as_flattened().iter().map(Vec3::to_array);
        let position = binary.floats(ends, Purpose::Bounded(Use::Vertices));
        let attributes = Attributes { position, normal: None, uv: None, color: None };
        primitives.push(PrimitiveEntry { attributes, indices: None, material: None, mode: Some(LINES) });
    }
    MeshEntry { name: &mesh.name, primitives }
}

/// Primitives of triangles, which share their vertices.
fn faces(mesh: &Mesh, looks: &mut Looks, binary: &mut Binary) -> Vec<PrimitiveEntry> {
    let positions = mesh.positions.iter().map(Vec3::to_array);
    let position = binary.floats(positions, Purpose::Bounded(Use::Vertices));
    let unit = |n: &Vec3| match (n.length_squared() - 1.0).abs() <= 1e-6 {
        true => n.to_array(),
        false => n.as_dvec3().try_normalize().map_or(Vec3::Z, |n| n.as_vec3()).to_array(),
    };
    let mut attributes = Attributes { position, normal: None, uv: None, color: None };
    if !mesh.normals.is_empty() {
        attributes.normal = Some(binary.floats(mesh.normals.iter().map(unit), Purpose::Attribute));
    }
    if !mesh.uvs.is_empty() {
        attributes.uv = Some(binary.floats(mesh.uvs.iter().map(|uv| uv.to_array()), Purpose::Attribute));
    }
    if !mesh.colors.is_empty() {
        attributes.color = Some(binary.floats(mesh.colors.iter().map(|c| c.to_array()), Purpose::Attribute));
    }
    mesh.primitives
        .iter()
        .filter(|p| !p.triangles.is_empty())
        .map(|p| {
            let triangles = &mesh.triangles[p.triangles.start as usize..p.triangles.end as usize];
            let indices = Some(binary.indices(triangles, mesh.positions.len()));
            PrimitiveEntry {
                attributes,
                indices,
                material: p.material.map(|m| looks.material(m)),
                mode: None,
            }
        })
        .collect()
}

/// All cameras, hung where they belong.
pub(super) fn cameras<'a>(scene: &'a Scene, expanded: &mut Expanded<'a>) -> Vec<CameraEntry<'a>> {
    let mut entries = Vec::new();
    for (i, camera) in scene.cameras.iter().enumerate() {
        let (lens, back) = match camera.projection {
            CameraProjection::Perspective { fov_y, near } => {
                (Lens::Perspective { perspective: Perspective { yfov: fov_y, znear: near } }, 0.0)
            }
            CameraProjection::Orthographic { half_width, half_height, near, far } => {
                // glTF has no near plane behind the eye; the eye steps back instead.
                let back = (-near).max(0.0);
                let orthographic = Orthographic {
                    xmag: half_width,
                    ymag: half_height,
                    znear: near + back,
                    zfar: far + back,
                };
                (Lens::Orthographic { orthographic }, back)
            }
        };
        expanded.mount(i as u32, &camera.name, camera.node, &camera.local, back);
        entries.push(CameraEntry { name: &camera.name, lens });
    }
    entries
}
