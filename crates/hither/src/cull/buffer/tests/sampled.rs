//! The sampled buffer: what it calls hidden would be drawn at no pixel centre, by the rasteriser itself.

use super::*;
use glam::DQuat;

fn drawn_sampled(scene: &Scene, occluders: &[Occluder], view: &View, bands: usize) -> SampledBuffer {
    let buffer = SampledBuffer::in_bands(view, bands).unwrap();
    for instance in scene.instances() {
        buffer.draw(&occluders[instance.mesh as usize], &instance.world_from_mesh);
    }
    buffer
}

fn occluders_of(scene: &Scene) -> Vec<Occluder> {
    scene.meshes.iter().map(|m| Occluder::of_mesh(m, &scene.materials)).collect()
}

fn occluders_at(buffer: &SampledBuffer) -> Vec<Option<u32>> {
    let view = *buffer.view();
    let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
    pixels.map(|(x, y)| buffer.occluder(x, y)).collect()
}

/// Triangles with corners in a box from −1 to 1, or in the ball that touches its sides.
fn inside(random: &mut Random, ball: bool) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corner = |_| {
        let p = random.point(1.0);
        let p = if ball { p.normalize_or(DVec3::X) * 0.999_999 } else { (p * 4.0).round() / 4.0 };
        p.clamp(DVec3::NEG_ONE, DVec3::ONE).as_vec3()
    };
    ((0..60).map(corner).collect(), (0..20).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}

#[test]
fn what_is_hidden_from_samples_would_be_drawn_nowhere() {
    let random = &mut Random::new(31);
    let mut counts = [[0; 3]; 2];
    let mut only_the_mesh = 0;
    for seed in 0..250 {
        let scene = trouble::scene(seed + 900);
        let view = View { width: 97, height: 75, ..trouble::view(seed + 900) };
        let occluders = occluders_of(&scene);
        let bands = 1 + random.below(4) as usize;
        let buffer = drawn_sampled(&scene, &occluders, &view, bands);
        for _ in 0..40 {
            let ball = random.one_in(2);
            let (positions, triangles) = inside(random, ball);
            let (center, half) = (random.point(9.0), random.between(0.005, 0.7));
            let at = DAffine3::from_scale_rotation_translation(DVec3::splat(half), DQuat::IDENTITY, center);
            let mesh = Occludee::new(&positions, &triangles).unwrap();
            let around = Aabb { min: center - half, max: center + half };
            let of_hull = if ball { buffer.ask_sphere(center, half) } else { buffer.ask_box(&around) };
            let verdicts = [of_hull, buffer.ask_mesh(&mesh, &at)];
            (0..2).for_each(|k| counts[k][verdicts[k] as usize] += 1);
            if verdicts == [Verdict::Visible; 2] {
                continue;
            }
            only_the_mesh += u32::from(of_hull == Verdict::Visible);
            let with_it = drawn_sampled(&scene, &occluders, &view, bands);
            let number = with_it.draw(&Occluder::new(&positions, &triangles, Sides::Both).unwrap(), &at);
            let shows = occluders_at(&with_it).contains(&Some(number));
            assert!(!shows, "seed {seed}: {around:?} shows and was called {verdicts:?}, a ball: {ball}");
        }
    }
    assert!(counts.as_flattened().iter().all(|&c| c > 300), "{counts:?}");
    assert!(only_the_mesh > 20, "{only_the_mesh}");
}

#[test]
fn a_rectangle_reaches_as_far_as_snapping() {
    let (wall, view) = wall();
    let buffer = SampledBuffer::in_bands(&view, 8).unwrap();
    buffer.draw(&wall, &DAffine3::from_scale(DVec3::new(2.0, 2.0, 0.1)));
    let covered = |x: u32, y: u32| buffer.depth(x, y) > 0.0;
    let (x, y) = (view.width / 2, view.height / 2);
    let left = (0..x).find(|&x| covered(x, y)).unwrap();
    let right = (x..view.width).rfind(|&x| covered(x, y)).unwrap();
    let top = (0..y).find(|&y| covered(x, y)).unwrap();
    let bottom = (y..view.height).rfind(|&y| covered(x, y)).unwrap();
    // From the last covered centre to the first beyond it, less a little, at all four sides.
    let depth = buffer.depth(x, y) * 0.5;
    let ask = |beyond: [f64; 4]| {
        buffer.ask_rect(&ScreenRect {
            left: f64::from(left) - 0.5 + beyond[0],
            top: f64::from(top) - 0.5 + beyond[1],
            right: f64::from(right) + 1.5 - beyond[2],
            bottom: f64::from(bottom) + 1.5 - beyond[3],
            depth,
        })
    };
    let (snap, hair) = (1.0 / 256.0, 1e-9);
    assert_eq!(ask([snap + hair; 4]), Verdict::Hidden);
    for side in 0..4 {
        let mut beyond = [snap + hair; 4];
        beyond[side] = snap - hair;
        assert_eq!(ask(beyond), Verdict::Visible, "side {side}");
    }
    // Depths: behind by any bit is hidden, and as near is not.
    let [x, y] = [x, y].map(|v| f64::from(v) + 0.5);
    let held = buffer.depth(view.width / 2, view.height / 2);
    let at = |depth: f32| buffer.ask_rect(&ScreenRect { left: x, top: y, right: x, bottom: y, depth });
    assert_eq!([at(held.next_down()), at(held)], [Verdict::Hidden, Verdict::Visible]);
}

#[test]
fn a_rectangle_asks_the_samples_in_it() {
    let random = &mut Random::new(32);
    let mut counts = [0; 3];
    for seed in 0..60 {
        let scene = trouble::scene(seed);
        let view = View { width: 83, height: 61, ..trouble::view(seed) };
        let buffer = drawn_sampled(&scene, &occluders_of(&scene), &view, 2);
        let mut rects = Vec::new();
        for _ in 0..200 {
            // Never within a snap of a centre.
            let [mut left, mut top] = [(); 2].map(|()| random.between(-20.0, 90.0).round() + 0.1);
            (left, top) = (left + random.below(2) as f64 * 0.5, top + random.below(2) as f64 * 0.5);
            let [w, h] = [(); 2].map(|()| random.below(30) as f64 * 0.7);
            let depth = random.between(-0.01, 0.3) as f32;
            rects.push(ScreenRect { left, top, right: left + w, bottom: top + h, depth });
        }
        let mut verdicts = Vec::new();
        buffer.ask_rects(&rects, &mut verdicts);
        for (rect, verdict) in rects.iter().zip(verdicts) {
            let inside = |v: u32, from: f64, to: f64| (from..=to).contains(&(f64::from(v) + 0.5));
            let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
            let pixels: Vec<(u32, u32)> = pixels
                .filter(|&(x, y)| inside(x, rect.left, rect.right) && inside(y, rect.top, rect.bottom))
                .collect();
            let hidden = pixels.iter().all(|&(x, y)| buffer.depth(x, y) > rect.depth);
            let truth = match (pixels.is_empty() || rect.depth <= 0.0, hidden) {
                (true, _) => Verdict::Outside,
                (_, true) => Verdict::Hidden,
                _ => Verdict::Visible,
            };
            let near_a_centre = [rect.right, rect.bottom]
                .iter()
                .any(|v| ((v - 0.5).fract()).abs() < 0.01 || ((v - 0.5).fract()).abs() > 0.99);
            assert!(near_a_centre || verdict == truth, "seed {seed}: {rect:?} is {verdict:?}, not {truth:?}");
            counts[verdict as usize] += 1;
        }
    }
    assert!(counts.iter().all(|&c| c > 300), "{counts:?}");
}

/// A scene and a view of more than one band, its occluders, and many boxes.
fn in_several_bands(seed: u64) -> (Scene, View, Vec<Occluder>, Boxes) {
    let scene = trouble::scene(seed + 40);
    let view = View { width: 90, height: 130, ..trouble::view(seed + 40) };
    let boxes = (0..200)
        .map(|k| Random::new(seed * 1000 + k))
        .map(|mut r| (r.point(9.0), r.between(0.01, 0.6)))
        .map(|(center, half)| Aabb { min: center - half, max: center + half })
        .collect();
    let occluders = occluders_of(&scene);
    (scene, view, occluders, boxes)
}

#[test]
fn merging_samples_is_drawing_one_after_the_other() {
    let mut hidden = 0;
    for seed in 0..80 {
        let (scene, view, occluders, boxes) = in_several_bands(seed);
        let instances = scene.instances();
        let alone = drawn_sampled(&scene, &occluders, &view, 1);
        let halves = [(); 2].map(|()| SampledBuffer::in_bands(&view, 3).unwrap());
        let (first, last) = instances.split_at(instances.len() / 2);
        for (half, instances) in halves.iter().zip([first, last]) {
            for i in instances {
                half.draw(&occluders[i.mesh as usize], &i.world_from_mesh);
            }
        }
        let [mut merged, other] = halves;
        merged.merge(&other).unwrap();
        assert!(merged.depths() == alone.depths(), "seed {seed}: merged");
        assert!(occluders_at(&merged) == occluders_at(&alone), "seed {seed}: numbers merged");
        // Minima are true again.
        let (mut of_merged, mut of_alone) = (Vec::new(), Vec::new());
        alone.ask(&boxes, &mut of_alone);
        hidden += of_alone.iter().filter(|v| **v == Verdict::Hidden).count();
        for level in levels() {
            merged.level = level;
            merged.ask(&boxes, &mut of_merged);
            assert!(of_merged == of_alone, "seed {seed}: {level:?}");
        }
        // What is drawn after merging is numbered on.
        let number = merged.draw(&occluders[0], &DAffine3::from_translation(DVec3::Z));
        assert_eq!(number, instances.len() as u32);
        assert_eq!(alone.draw(&occluders[0], &DAffine3::from_translation(DVec3::Z)), number);
        assert!(occluders_at(&merged) == occluders_at(&alone), "seed {seed}: numbers go on");
        merged.clear();
        assert_eq!(merged.draw(&occluders[0], &DAffine3::IDENTITY), 0);
        assert_eq!(merged.merge(&alone), Err(CannotMerge));
    }
    assert!(hidden > 500, "{hidden}");
}

#[test]
fn threads_that_draw_samples_and_ask_at_once_change_nothing() {
    for seed in 0..80 {
        let (scene, view, occluders, boxes) = in_several_bands(seed);
        let instances = scene.instances();
        let alone = drawn_sampled(&scene, &occluders, &view, 1);
        let mut of_alone = Vec::new();
        alone.ask(&boxes, &mut of_alone);
        let mut shared = SampledBuffer::in_bands(&view, 4).unwrap();
        let work = |me: usize| {
            let mut verdicts = Vec::new();
            for i in instances.iter().skip(me).step_by(2) {
                shared.draw(&occluders[i.mesh as usize], &i.world_from_mesh);
                shared.ask(&boxes, &mut verdicts);
                let mut both = verdicts.iter().zip(&of_alone);
                let holds = both.all(|(now, end)| *now != Verdict::Hidden || *end == Verdict::Hidden);
                assert!(holds, "seed {seed}");
            }
        };
        std::thread::scope(|scope| {
            scope.spawn(|| work(1));
            work(0);
        });
        assert!(shared.depths() == alone.depths(), "seed {seed}: by threads");
        for turned in [View { width: 90, height: 130, ..trouble::view(seed) }, trouble::view(seed)] {
            shared.look(&turned).unwrap();
            assert!(shared.depths().iter().all(|&d| d == 0.0), "seed {seed}");
            for i in &instances {
                shared.draw(&occluders[i.mesh as usize], &i.world_from_mesh);
            }
            let anew = drawn_sampled(&scene, &occluders, &turned, 1);
            assert!(shared.depths() == anew.depths(), "seed {seed}: turned");
        }
    }
}
