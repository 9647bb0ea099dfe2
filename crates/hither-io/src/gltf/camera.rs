//! Cameras: one for every node of the scene that carries one, called by its own name or by its node's.

use super::fault::{Oddities, part};
use super::json::{self, Document};
use super::node::Hierarchy;
use hither::scene::{Camera, CameraProjection, Transform};

/// Reads the scene's cameras, in the order of the file.
pub(super) fn read(document: &Document, hierarchy: &Hierarchy, oddities: &mut Oddities) -> Vec<Camera> {
    let mut carried: Vec<(usize, u32, usize)> = Vec::new();
    for (i, node) in document.nodes.iter().enumerate() {
        if let (Some(camera), Some(place)) = (node.camera, hierarchy.place[i]) {
            carried.push((camera.at(), place, i));
        }
    }
    carried.sort_unstable();
    let mut cameras = Vec::new();
    for (index, place, node) in carried {
        let Some(source) = document.cameras.get(index) else {
            let node = part("node", node, &document.nodes[node].name);
            oddities.note(node, format!("it carries camera {index}, which does not exist"));
            continue;
        };
        let name =
            if source.name.is_empty() { document.nodes[node].name.clone() } else { source.name.clone() };
        match lens(source) {
            Some(projection) => {
                cameras.push(Camera { name, node: Some(place), local: Transform::default(), projection });
            }
            None => oddities.note(
                part("camera", index, &name),
                "its field of view or its clipping planes are out of range; it is left out",
            ),
        }
    }
    cameras
}

fn lens(source: &json::Camera) -> Option<CameraProjection> {
    if let Some(p) = &source.perspective {
        let usable = p.yfov > 0.0 && p.yfov < std::f64::consts::PI && p.znear > 0.0;
        return usable.then_some(CameraProjection::Perspective { fov_y: p.yfov, near: p.znear });
    }
    let o = source.orthographic.as_ref()?;
    // Some exporters write mirrored magnitudes; a mirrored picture is never meant.
    let (half_width, half_height) = (o.xmag.abs(), o.ymag.abs());
    let usable = half_width > 0.0 && half_height > 0.0 && o.zfar > o.znear;
    usable.then_some(CameraProjection::Orthographic { half_width, half_height, near: o.znear, far: o.zfar })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lenses_out_of_range_are_left_out() {
        let perspective = |yfov, znear| {
            let perspective = Some(json::Perspective { yfov, znear });
            lens(&json::Camera { perspective, ..Default::default() })
        };
        assert_eq!(perspective(1.0, 0.1), Some(CameraProjection::Perspective { fov_y: 1.0, near: 0.1 }));
        for (yfov, znear) in [(0.0, 0.1), (3.2, 0.1), (1.0, 0.0), (-1.0, 0.1)] {
            assert_eq!(perspective(yfov, znear), None);
        }
        let orthographic = |xmag, znear, zfar| {
            let orthographic = Some(json::Orthographic { xmag, ymag: 2.0, znear, zfar });
            lens(&json::Camera { orthographic, ..Default::default() })
        };
        assert!(orthographic(-1.0, 0.0, 10.0).is_some());
        assert!(orthographic(0.0, 0.0, 10.0).is_none());
        assert!(orthographic(1.0, 5.0, 5.0).is_none());
    }
}
