//! A picture by layers: whole parts sorted, each drawn alone, composited.

use crate::commands::sorting::{LayerOptions, PartOptions, Prepared, Sorting};
use crate::console::Verbosity;
use crate::failure::Failure;
use hither::Scene;
use hither::layers::{LayerPainter, PaintOptions, Program, Sprite};
use hither::order::SortOptions;
use hither::render::{Frame, Image, Shading};

/// Composites the picture of `frame`'s view, and says which parts occlude each other so that they were drawn
/// together.
pub fn picture(
    scene: &Scene,
    source: &str,
    frame: &Frame,
    shading: Shading,
    verbosity: Verbosity,
) -> Result<Image, Failure> {
    let view = &frame.view;
    let slack = 1.0 / (256.0 * view.pixels_per_unit()) + 1e-6;
    let options = SortOptions { slack, ..SortOptions::default() };
    let parts = PartOptions::default();
    // Nothing is split, and the scene stays as it is.
    let prepared = Prepared::of(scene);
    let mut sorting = Sorting::new(scene, source, &parts, &prepared, options, verbosity)?;
    sorting.sort(scene, view);
    let mut painter = LayerPainter::new(scene);
    let paint = PaintOptions { shading, ..PaintOptions::default() };
    let (components, _) = sorting.components(&LayerOptions::default(), &mut painter, view, &paint)?;
    let mut sprites: Vec<Sprite> = Vec::new();
    for parts in components.iter().flat_map(|c| &c.layers) {
        let instances = sorting.instances_of(parts);
        let painted = painter.paint(&instances, view, &paint).map_err(|e| Failure::work(e.to_string()))?;
        sprites.push(painted.sprite);
        if parts.len() > 1 {
            let names = parts.iter().map(|&p| sorting.name(p)).collect::<Vec<_>>().join(", ");
            verbosity.detail(&format!("in a binary cycle, drawn together: {names}"));
        }
    }
    let merged: usize = components.iter().flat_map(|c| &c.layers).map(Vec::len).filter(|&n| n > 1).sum();
    if merged > 0 {
        verbosity.note(&format!(
            "{merged} parts occlude each other both ways and are drawn together; -v names them"
        ));
    }
    let canvas = Program::compile(&components).run((view.width, view.height), |l| sprites.get(l as usize));
    Ok(Image { width: view.width, height: view.height, pixels: canvas.pixels })
}
