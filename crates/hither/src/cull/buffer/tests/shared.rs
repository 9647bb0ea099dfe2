//! Threads that draw into and ask one buffer at once.

use super::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Boxes and balls, many of them behind what `scene` draws.
fn asked(random: &mut Random) -> (Boxes, Vec<Ball>) {
    let bounds = |_| {
        let (center, size) = (random.point(12.0), random.between(0.01, 0.6));
        Aabb { min: center - size, max: center + size }
    };
    let boxes = (0..150).map(bounds).collect();
    let ball = |_| Ball { center: random.point(12.0), radius: random.between(0.01, 0.6) };
    (boxes, (0..50).map(ball).collect())
}

/// Asserts of one thread's answers that what was hidden stays so and is so in the end; returns how many were.
fn agree_with_the_end(answers: &[Vec<Verdict>], truth: &[Verdict], seed: u64) -> usize {
    let outside = |v: Verdict| v == Verdict::Outside;
    for (n, answer) in answers.iter().enumerate() {
        for (k, (&now, &end)) in answer.iter().zip(truth).enumerate() {
            let was_hidden = n > 0 && answers[n - 1][k] == Verdict::Hidden;
            assert!(!was_hidden || now == Verdict::Hidden, "seed {seed}: {k} is shown again");
            assert!(now != Verdict::Hidden || end == Verdict::Hidden, "seed {seed}: {k} shows");
            assert!(outside(now) == outside(end), "seed {seed}: {k} is outside, and is not");
        }
    }
    answers.iter().flatten().filter(|v| **v == Verdict::Hidden).count()
}

#[test]
fn what_is_hidden_while_others_draw_is_hidden_in_the_end() {
    let (mut hidden_meanwhile, mut hidden_in_the_end) = (0, 0);
    for seed in 0..120 {
        let scene = trouble::scene(seed + 4000);
        // Large enough for three bands.
        let view = View { width: 160, height: 192, ..trouble::view(seed + 4000) };
        let occluders: Vec<Occluder> =
            scene.meshes.iter().map(|m| Occluder::of_mesh(m, &scene.materials)).collect();
        let instances = scene.instances();
        let (boxes, balls) = asked(&mut Random::new(seed));
        let options = OcclusionOptions::default();
        let mut alone = OcclusionBuffer::new(&view, &options).unwrap();
        for i in &instances {
            alone.draw(&occluders[i.mesh as usize], &i.world_from_mesh);
        }
        let (mut truth, mut of_balls) = (Vec::new(), Vec::new());
        alone.ask(&boxes, &mut truth);
        alone.ask_balls(&balls, &mut of_balls);
        truth.extend(of_balls);

        let shared = SharedBuffer::new(&view, &options, 3).unwrap();
        let ask = || {
            let (mut verdicts, mut of_balls) = (Vec::new(), Vec::new());
            shared.ask(&boxes, &mut verdicts);
            shared.ask_balls(&balls, &mut of_balls);
            verdicts.extend(of_balls);
            verdicts
        };
        let done = [const { AtomicBool::new(false) }; 2];
        // Each draws every other instance, and asks after each and on until the other is done, too.
        let work = |me: usize| {
            let mut answers = Vec::new();
            for i in instances.iter().skip(me).step_by(2) {
                shared.draw(&occluders[i.mesh as usize], &i.world_from_mesh);
                answers.push(ask());
            }
            done[me].store(true, Ordering::Release);
            while !done[1 - me].load(Ordering::Acquire) {
                answers.push(ask());
            }
            answers
        };
        let answers = std::thread::scope(|scope| {
            let others = scope.spawn(|| work(1));
            let mine = work(0);
            [mine, others.join().unwrap()]
        });
        assert!(alone.depths() == shared.depths(), "seed {seed}: the shared buffer holds something else");
        assert!(ask() == truth, "seed {seed}: the shared buffer answers otherwise in the end");
        hidden_meanwhile += answers.iter().map(|one| agree_with_the_end(one, &truth, seed)).sum::<usize>();
        hidden_in_the_end += truth.iter().filter(|v| **v == Verdict::Hidden).count();
    }
    assert!(hidden_meanwhile > 500 && hidden_in_the_end > 500, "{hidden_meanwhile} {hidden_in_the_end}");
}

#[test]
fn a_shared_buffer_is_emptied_and_looks_from_elsewhere() {
    for seed in 0..60 {
        let scene = trouble::scene(seed);
        let occluders: Vec<Occluder> =
            scene.meshes.iter().map(|m| Occluder::of_mesh(m, &scene.materials)).collect();
        let sized = |seed, width, height| View { width, height, ..trouble::view(seed) };
        let views = [sized(seed, 70, 150), sized(seed + 1, 70, 150), sized(seed + 2, 150, 70)];
        let mut shared = SharedBuffer::new(&views[0], &OcclusionOptions::default(), 3).unwrap();
        for (k, view) in views.iter().enumerate() {
            if k > 0 {
                shared.look(view).unwrap();
            }
            assert!(shared.depths().iter().all(|&d| d == 0.0), "seed {seed}");
            for i in scene.instances() {
                shared.draw(&occluders[i.mesh as usize], &i.world_from_mesh);
            }
            let alone = drawn(&scene, view, &OcclusionOptions::default());
            assert!(shared.depths() == alone.depths(), "seed {seed}, view {k}");
        }
        shared.clear();
        assert!(shared.depths().iter().all(|&d| d == 0.0), "seed {seed}");
    }
}
