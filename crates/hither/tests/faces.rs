//! The visible faces of a drawing, at the centres of pixels, are what the z-buffer shows there.

use glam::DVec2;
use hither::hidden_line::{Face, FaceColor, Kinds, LineOptions, Preparation, PrepareOptions};
use hither::reference::lines::LineOracle;
use hither::reference::trouble;
use hither::scene::{AlphaMode, Material};
use hither::{Algorithm, IndexOptions, RenderOptions, Scene, SceneIndex, render};

/// Nearer to an outline than this, pixels, the z-buffer's snapping to 1/256 of a pixel may decide.
const SNAPPED: f64 = 1.0 / 128.0;

/// A scene whose surfaces hide whichever side is seen, without holes, as those of a drawing do.
fn scene(seed: u64) -> Scene {
    let mut scene = trouble::scene(seed);
    scene.materials = vec![Material { double_sided: true, ..Material::default() }];
    assert_eq!(scene.materials[0].alpha, AlphaMode::Opaque);
    for primitive in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
        primitive.material = Some(0);
    }
    scene
}

/// Whether `p` is in the face, by crossings; and whether it is near the face's outline.
fn meets(face: &Face, p: DVec2) -> (bool, bool) {
    let (mut inside, mut near) = (false, false);
    for contour in &face.contours {
        for (i, &a) in contour.iter().enumerate() {
            let b = contour[(i + 1) % contour.len()];
            if (a.y <= p.y) != (b.y <= p.y) && a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y)) > p.x {
                inside = !inside;
            }
            let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            near |= p.distance(a.lerp(b, if along.is_nan() { 0.0 } else { along })) < SNAPPED;
        }
    }
    (inside, near)
}

#[test]
fn faces_are_what_the_z_buffer_shows() {
    let (mut same, mut near_outlines, mut ties) = (0, 0, 0);
    for seed in 0..80 {
        let scene = scene(seed);
        let large = scene.bounds().is_none_or(|b| b.size().max_element() > 200.0);
        if large || scene.instanced_triangle_count() > 600 {
            continue;
        }
        let mut view = trouble::view(seed);
        (view.width, view.height) = (71, 57);
        let preparation = Preparation::new(&scene, &PrepareOptions::default());
        let options =
            LineOptions { faces: Some(FaceColor::White), kinds: Kinds::NONE, ..LineOptions::default() };
        let faces = preparation.draw(&view, &options).unwrap().faces;
        let oracle = LineOracle::new(&scene, &view, preparation.tolerance());
        let index = SceneIndex::build(scene, &IndexOptions::default());
        let frames = [Algorithm::ZBuffer, Algorithm::Hzb]
            .map(|algorithm| render(&index, &view, &RenderOptions { algorithm, ..RenderOptions::default() }));
        for (x, y) in (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y))) {
            let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let found: Vec<(bool, bool)> = faces.iter().map(|face| meets(face, p)).collect();
            let drawn: Vec<u32> = (faces.iter().zip(&found)).filter(|f| f.1.0).map(|f| f.0.part).collect();
            for frame in &frames {
                let shown = frame.as_ref().unwrap().id(x, y).map(|id| id.instance);
                if drawn.len() <= 1 && drawn.first() == shown.as_ref() {
                    same += 1;
                } else if found.iter().any(|f| f.1) {
                    near_outlines += 1;
                } else {
                    assert!(
                        oracle.seen_at(p).is_none(),
                        "seed {seed} at {p}: faces of {drawn:?}, {shown:?} in the z-buffer"
                    );
                    ties += 1;
                }
            }
        }
    }
    assert!(same > 200_000, "{same}");
    assert!(
        (near_outlines + ties) * 500 < same,
        "{near_outlines} near outlines, {ties} ties, {same} the same"
    );
}
