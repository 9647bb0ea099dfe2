//! What tests share that go through every world.
#![allow(dead_code)] // Each test uses some of it.

use glam::DVec3;
use hither::conventions::{Projection, View};
use hither::reference::trouble::Random;
use hither::scene::Scene;
use hither::{RenderOptions, SceneIndex, render};
use std::collections::HashSet;

/// Asserts that `specs` name every world there is, in order.
pub fn assert_every_world_is_in(specs: &[&str]) {
    let looked_at: Vec<&str> = specs.iter().filter_map(|spec| spec.split('?').next()).collect();
    let worlds: Vec<&str> = hither_worlds::list().iter().map(|info| info.name).collect();
    assert_eq!(looked_at, worlds);
}

/// The views of all cameras of a scene, each of a size of its own.
pub fn views_of_cameras(scene: &Scene, mut size: impl FnMut() -> (u32, u32)) -> Vec<View> {
    (0..scene.cameras.len()).filter_map(|camera| scene.view(camera, size())).collect()
}

/// The views of all cameras, and two from random points near instances.
pub fn views(scene: &Scene, random: &mut Random) -> Vec<View> {
    let size = |random: &mut Random| (80 + random.below(120), 60 + random.below(90));
    let mut views = views_of_cameras(scene, || size(random));
    let instances = scene.instances();
    for orthographic in [false, true] {
        let place = |random: &mut Random| {
            let instance = &instances[random.below(instances.len() as u32) as usize];
            let mesh = &scene.meshes[instance.mesh as usize];
            let vertex = mesh.positions[random.below(mesh.positions.len() as u32) as usize];
            instance.world_from_mesh.transform_point3(vertex.as_dvec3())
        };
        let (eye, target) = (place(random) + random.point(0.3), place(random));
        let projection = match orthographic {
            true => {
                Projection::Orthographic { half_height: random.between(0.5, 20.0), near: -1.0, far: 200.0 }
            }
            false => Projection::Perspective { fov_y: random.between(0.5, 2.0), near: 0.05 },
        };
        views.push(View::look_at(eye, target + DVec3::Z * 1e-3, DVec3::Y, projection, size(random)));
    }
    views
}

/// The instances nearest at the samples of a picture `times` as fine each way.
pub fn seen(index: &SceneIndex, view: &View, times: u32) -> HashSet<u32> {
    let fine = View { width: view.width * times, height: view.height * times, ..*view };
    let frame = render(index, &fine, &RenderOptions::default()).unwrap();
    let pixels = (0..fine.height).flat_map(|y| (0..fine.width).map(move |x| (x, y)));
    pixels.filter_map(|(x, y)| frame.id(x, y)).map(|id| id.instance).collect()
}
