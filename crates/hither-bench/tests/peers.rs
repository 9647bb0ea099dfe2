//! The peers are set up right: they see what the textbook z-buffer sees.

use hither::conventions::{Projection, View};
use hither::reference::zbuffer;
use hither::scene::Scene;
use hither_bench::peers::{Peer, Sighting, obvhs::Obvhs};

/// Share of pixels with the same distance to one part in 10,000.
fn same_distance(scene: &Scene, view: &View, peer: &dyn Peer, threads: usize) -> f64 {
    let drawing = zbuffer::draw(scene, view);
    let mut sighting = Sighting::default();
    peer.frame(view, threads, &mut sighting);
    assert_eq!(sighting.distance.len(), drawing.depth.len());
    let same = drawing.depth.iter().zip(&sighting.distance).filter(|&(&depth, &found)| {
        let (truth, found) = (view.projection.distance(depth), f64::from(found));
        (truth - found).abs() <= 1e-4 * truth || (truth.is_infinite() && found.is_infinite())
    });
    same.count() as f64 / drawing.depth.len() as f64
}

/// Scenes with and without instances, seen by pinholes and in parallel, in odd sizes.
fn check(build: impl Fn(&Scene) -> Box<dyn Peer>) {
    for (spec, camera) in
        [("office?n=2", "corridor"), ("office?n=2", "outside"), ("boxcity", "street"), ("clutter", "front")]
    {
        let scene = hither_worlds::generate(spec).unwrap();
        let peer = build(&scene);
        let view = scene.find_camera(camera).and_then(|c| scene.view(c, (161, 93))).unwrap();
        let parallel = View {
            projection: Projection::Orthographic { half_height: 15.0, near: 0.0, far: 400.0 },
            ..view
        };
        for view in [view, parallel] {
            for threads in [1, 3] {
                let share = same_distance(&scene, &view, peer.as_ref(), threads);
                assert!(share > 0.99, "{}: {spec} {camera}: {share} of the pixels agree", peer.name());
            }
        }
    }
}

#[test]
fn obvhs_sees_what_the_textbook_z_buffer_sees() {
    check(|scene| Box::new(Obvhs::build(scene)));
}

#[cfg(feature = "embree")]
#[test]
fn embree_sees_what_the_textbook_z_buffer_sees() {
    use hither_bench::peers::embree::{Embree, EmbreeError};
    let bare = hither_worlds::generate("office?n=1").unwrap();
    if let Err(EmbreeError::NotFound(why)) = Embree::build(&bare).map(drop) {
        eprintln!("skipped: Embree is not on this machine ({why})");
        return;
    }
    check(|scene| Box::new(Embree::build(scene).unwrap()));
}

#[test]
fn an_unknown_table_is_named_and_the_known_ones_are_listed() {
    let fault = hither_bench::run(Some("exakt"), &hither_bench::Options::default()).unwrap_err().to_string();
    assert!(fault.starts_with("there is no benchmark \"exakt\"; there are exact, greene"), "{fault}");
}
