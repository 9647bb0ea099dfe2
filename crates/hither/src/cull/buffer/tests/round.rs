//! Closed convex patches of many faces.

use super::*;

/// Closed convex bodies of many faces: balls, barrels, pillars, cones, flattened or not, some far from their origin; and a
/// few that are not quite convex.
pub(super) fn round_bodies(seed: u64) -> (Scene, View) {
    let random = &mut Random::new(seed);
    let (mut scene, view) = (Scene::new("round bodies"), some_view(random, 120, 30.0));
    scene.materials = vec![Material { double_sided: random.one_in(4), ..Material::default() }];
    for _ in 0..1 + random.below(5) {
        let (rings, spokes) = (3 + random.below(12), 3 + random.below(26));
        let mut mesh = lump(random, rings, spokes, 0.0);
        match random.below(4) {
            0 => mesh.positions.iter_mut().for_each(|p| p.y = p.y.clamp(-0.5, 0.7)),
            1 => mesh.positions.iter_mut().for_each(|p| {
                let wide = (1.0 - p.y) * 0.5 / (p.x * p.x + p.z * p.z).sqrt().max(1e-3);
                (p.x, p.z) = (p.x * wide, p.z * wide);
            }),
            _ => {}
        }
        if random.one_in(8) {
            let v = random.below(mesh.positions.len() as u32) as usize;
            mesh.positions[v] *= random.between(0.8, 1.2) as f32;
        }
        let mut size = || [0.01, 0.2, 1.0, 2.0][random.below(4) as usize];
        let scale = DVec3::new(size(), size(), size()) * [1.0, -1.0][random.below(2) as usize];
        let away = [0.0, 0.0, 30.0, 1000.0][random.below(4) as usize];
        let away = DVec3::new(away, -away, away);
        mesh.positions.iter_mut().for_each(|p| *p += away.as_vec3());
        scene.meshes.push(mesh);
        let axis = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.3).normalize();
        let rotation = glam::DQuat::from_axis_angle(axis, random.between(0.0, 6.3));
        let at = DVec3::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0), random.between(-3.0, 3.0));
        let translation = at - rotation * (scale * away);
        let local = Transform::Trs { translation, rotation, scale };
        let content = Content::Mesh(scene.meshes.len() as u32 - 1);
        scene.groups[0].push(Node { content, local, ..Node::default() });
    }
    (scene, view)
}

fn is_round(mesh: &Mesh, materials: &[Material]) -> bool {
    Occluder::of_mesh(mesh, materials).patches.iter().any(|patch| patch.round.is_some())
}

#[test]
fn most_bodies_are_round() {
    let (round, all) = (0..200).fold((0, 0), |(found, all), seed| {
        let (scene, _) = round_bodies(seed);
        let round = scene.meshes.iter().filter(|m| is_round(m, &scene.materials)).count();
        (found + round, all + scene.meshes.len())
    });
    assert!(round * 10 > all * 6, "{round} of {all}");
}

#[test]
fn no_pixel_holds_more_than_is_there_on_round_bodies() {
    let (covered, shot) = attack_all(3000, round_bodies, 4, 22);
    assert!(covered > 200_000 && shot > 800_000, "{covered} pixels, {shot} rays");
}

#[test]
fn round_bodies_cover_what_their_faces_cover() {
    // Both at the rim hold the depth of what is farthest in a block; which faces that is differs.
    let sum = compared(1500, round_bodies);
    let differ = (sum.one * 100).max(sum.nearer * 10).max(sum.farther * 10);
    assert!(sum.both > 200_000 && differ < sum.both, "{sum:?}");
}
