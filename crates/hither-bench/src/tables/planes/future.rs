//! What the paper leaves to the future [Coorg & Teller 1996, §5]: a bound on what is visible from wherever
//! the eye may get to, and virtual occluders inside meshes of many small polygons.

use super::super::{TableInfo, column, world};
use super::{MODELS, walk_of};
use crate::Options;
use crate::report::{Cell, Table};
use crate::timing::{median, timed};
use glam::DVec3;
use hither::Scene;
use hither::cull::planes::{Amount, Culled, PlaneCuller, PlanesOptions};

pub(crate) const FUTURE: TableInfo = TableInfo {
    name: "planes",
    title: "[Coorg & Teller 1996, §5] eyes within reach, and virtual occluders, one thread",
    make,
    columns: &[
        column("scene", "scene", 0),
        column("what", "what", 0),
        column("polygons", "polygons", 0),
        column("build_ms", "build ms", 1),
        column("k", "k", 0),
        column("hidden", "hidden", 0),
        column("hidden_share", "share of all", 3),
        column("first_ms", "first eye ms", 3),
    ],
};

/// Eyes of a walk that are looked from.
const EYES: usize = 20;

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    for model in MODELS {
        (options.progress)(&format!("planes: {}, eyes within reach", model.name));
        let scene = world(model.name)?;
        let eyes: Vec<DVec3> = walk_of(model.name, 1, 1.0)?.into_iter().step_by(600 / EYES).collect();
        let how = PlanesOptions { occluders: Amount::Fixed(64), ..PlanesOptions::default() };
        for reach in [0.0, 0.15, 0.5, 1.5] {
            let what = if reach > 0.0 { format!("within {reach} m") } else { "this eye".to_owned() };
            let look = |culler: &mut PlaneCuller, eye| match reach {
                0.0 => culler.look_around(eye),
                _ => culler.foresee(eye, reach),
            };
            row(table, model.name, &what, &scene, &how, &eyes, look)?;
        }
    }
    (options.progress)("planes: virtual occluders");
    let scene = balls()?;
    let eyes = [0.0, 1.0, 2.0, 3.0].map(|i| DVec3::new(10.0 * i - 15.0, 4.0 * i - 6.0, 120.0 - i));
    for (what, virtual_occluders) in [("own polygons", false), ("virtual occluders", true)] {
        let how =
            PlanesOptions { occluders: Amount::Fixed(192), virtual_occluders, ..PlanesOptions::default() };
        row(table, "300 of spheres", what, &scene, &how, &eyes, |culler, eye| culler.look_around(eye))?;
    }
    table.notes.push("this eye and within: 64 occluders; separate ones are fused for this eye only".into());
    table.notes.push("spheres: the first 300 balls of 512 triangles, all two-sided; 192 occluders".into());
    Ok(())
}

fn row(
    table: &mut Table,
    scene_name: &str,
    what: &str,
    scene: &Scene,
    how: &PlanesOptions,
    eyes: &[DVec3],
    look: impl Fn(&mut PlaneCuller, DVec3) -> Result<Culled, hither::cull::planes::PlanesError>,
) -> Result<(), String> {
    let (build, mut culler) = timed(|| PlaneCuller::new(scene, how));
    let all = culler.model().polygons().len();
    let (mut hidden, mut occluders, mut times) = (0, 0, Vec::new());
    for &eye in eyes {
        culler.forget();
        let (time, looked) = timed(|| look(&mut culler, eye));
        let looked = looked.map_err(|e| e.to_string())?;
        hidden += all - looked.visible.len();
        occluders += looked.occluders;
        times.push(time);
    }
    let mean = hidden as f64 / eyes.len() as f64;
    table.push([
        Cell::from(scene_name),
        what.into(),
        all.into(),
        (build.as_secs_f64() * 1e3).into(),
        (occluders as f64 / eyes.len() as f64).into(),
        mean.into(),
        (mean / all as f64).into(),
        (median(&mut times).as_secs_f64() * 1e3).into(),
    ]);
    Ok(())
}

/// Balls of many polygons, none of which hides much alone.
fn balls() -> Result<Scene, String> {
    let mut scene = world("spheres?parts=1")?;
    scene.groups[0].nodes.truncate(300);
    scene.materials.iter_mut().for_each(|m| m.double_sided = true);
    Ok(scene)
}
