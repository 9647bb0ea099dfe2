//! What tests share that go through every world.

use hither::conventions::View;
use hither::scene::Scene;

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
