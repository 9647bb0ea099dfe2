//! scratch
use hither::order::*;
use std::time::Instant;
fn main() {
    let spec = std::env::args().nth(1).unwrap();
    let frames: u32 = std::env::args().nth(2).map(|s| s.parse().unwrap()).unwrap_or(100);
    let mut scene = hither_worlds::generate(&spec).unwrap();
    let parts = Parts::of(&scene, &Granularity::default()).unwrap();
    let mut sort = VisibilitySort::new(SortOptions::default());
    parts.add_to(&mut sort);
    for (a, b, k) in hither_worlds::known_relations(&scene) { sort.know(a, b, k); }
    let (mut total, mut worst) = (0.0, 0.0f64); let mut all = vec![];
    let mut sums = [0.0f64; 8];
    let mut last = Counters::default();
    for f in 0..frames {
        scene.pose(0, f64::from(f) / 60.0);
        let instances = scene.instances();
        let view = scene.view(0, (640, 480)).unwrap();
        let start = Instant::now();
        parts.place_at(&mut sort, &instances);
        sort.sort(view.eye_in_world());
        let t = start.elapsed().as_secs_f64() * 1e3;
        if f > 0 { all.push(t); total += t; worst = worst.max(t); }
        let c = sort.counters();
        last = c;
        let scc = sort.order().groups().count() as f64;
        sums[0] += c.groups as f64 / scc;
        sums[1] += c.grouped_parts as f64 / c.parts as f64;
        if c.groups > 0 { sums[2] += c.grouped_parts as f64 / c.groups as f64; }
        sums[3] += c.largest_group as f64;
        sums[4] += c.exact_tests as f64;
        sums[5] += c.arcs_found as f64;
        sums[6] += c.candidates as f64;
        sums[7] += c.moved_up as f64;
    }
    all.sort_by(f64::total_cmp); println!("{spec}: min {:.3} median {:.3} avg {:.3} ms worst {:.3} ms  {last:?}", all[0], all[all.len()/2], total / f64::from(frames - 1), worst);
    println!("   scc share {:.4} parts share {:.4} avg size {:.3} max size {:.2} tests {:.0} arcs {:.0} cand {:.0} moved {:.0}", sums[0]/f64::from(frames), sums[1]/f64::from(frames), sums[2]/f64::from(frames), sums[3]/f64::from(frames), sums[4]/f64::from(frames), sums[5]/f64::from(frames), sums[6]/f64::from(frames), sums[7]/f64::from(frames));
}
