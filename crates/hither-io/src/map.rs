//! Top views of what occluder planes hide, as SVG, in the manner of Coorg & Teller's figures 10 and 11.
//!
//! Green: hidden. Cyan: may be seen. Blue: outside the view. Black: the occluders in use. Yellow: the leaf
//! that holds the eye; red: the eye. Tinted areas are the tree's boxes, lines the polygons.

use crate::{Error, write_whole};
use glam::DVec2;
use hither::cull::planes::{State, TopView};
use std::io::{self, Write};
use std::path::Path;

/// Longer side of the picture, in SVG units.
const SIDE: f64 = 1200.0;
/// Room around the plan.
const MARGIN: f64 = 20.0;

/// Writes `view` to `path`, whole or not at all.
pub fn write_map(path: &Path, view: &TopView) -> Result<(), Error> {
    write_whole(path, |file| write(file, view))
}

/// From metres to SVG units.
struct Sheet {
    origin: DVec2,
    scale: f64,
}

impl Sheet {
    fn place(&self, p: DVec2) -> DVec2 {
        (p - self.origin) * self.scale + MARGIN
    }

    fn points(&self, corners: &[DVec2]) -> String {
        let place = |p: &DVec2| {
            let p = self.place(*p);
            format!("{:.1},{:.1}", p.x, p.y)
        };
        corners.iter().map(place).collect::<Vec<_>>().join(" ")
    }

    fn rectangle(&self, corners: [DVec2; 2]) -> String {
        let [min, max] = corners.map(|p| self.place(p));
        let size = (max - min).max(DVec2::splat(0.5));
        format!(r#"x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}""#, min.x, min.y, size.x, size.y)
    }
}

/// Fill of boxes and stroke of polygons.
fn colors(state: State) -> (&'static str, &'static str) {
    match state {
        State::Outside => ("#b9c6f2", "#3453c4"),
        State::Hidden => ("#bfe6c0", "#2f8f3a"),
        State::Partial | State::Visible => ("#b5ecf0", "#0793a3"),
    }
}

fn write(file: &mut dyn Write, view: &TopView) -> io::Result<()> {
    let all = view.polygons.iter().flat_map(|p| &p.corners).chain([&view.eye]);
    let (min, max) = all.fold((view.eye, view.eye), |(min, max), p| (min.min(*p), max.max(*p)));
    let scale = SIDE / (max - min).max_element().max(1e-9);
    let sheet = Sheet { origin: min, scale };
    let size = (max - min) * scale + 2.0 * MARGIN;
    writeln!(
        file,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {:.1} {:.1}" width="{:.1}" height="{:.1}">"#,
        size.x, size.y, size.x, size.y
    )?;
    writeln!(file, r#"<rect width="100%" height="100%" fill="white"/>"#)?;
    if let Some(leaf) = view.leaf {
        writeln!(file, r##"<rect {} fill="#ffe94a"/>"##, sheet.rectangle(leaf))?;
    }
    // What may be seen goes on top: floors and ceilings share the plan with what stands between.
    for wanted in [State::Outside, State::Hidden, State::Visible, State::Partial] {
        writeln!(file, r#"<g fill="{}" fill-opacity="0.45">"#, colors(wanted).0)?;
        for b in view.boxes.iter().filter(|b| b.state == wanted) {
            writeln!(file, "<rect {}/>", sheet.rectangle(b.corners))?;
        }
        writeln!(file, "</g>")?;
    }
    for wanted in [State::Outside, State::Hidden, State::Visible] {
        writeln!(file, r#"<g fill="none" stroke="{}" stroke-width="1.2">"#, colors(wanted).1)?;
        for p in view.polygons.iter().filter(|p| p.state == wanted) {
            writeln!(file, r#"<polygon points="{}"/>"#, sheet.points(&p.corners))?;
        }
        writeln!(file, "</g>")?;
    }
    writeln!(file, r#"<g fill="none" stroke="black" stroke-width="3" stroke-linejoin="round">"#)?;
    for corners in &view.occluders {
        writeln!(file, r#"<polygon points="{}"/>"#, sheet.points(corners))?;
    }
    writeln!(file, "</g>")?;
    let eye = sheet.place(view.eye);
    writeln!(file, r##"<circle cx="{:.1}" cy="{:.1}" r="5" fill="#d40000"/>"##, eye.x, eye.y)?;
    writeln!(file, "</svg>")
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hither::cull::planes::{PlaneCuller, PlanesOptions};

    #[test]
    fn a_map_shows_every_polygon_and_occluder() {
        let scene = hither::reference::trouble::scene(3);
        let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
        let culled = culler.look_around(DVec3::new(5.0, 0.0, 0.0)).unwrap();
        let view = culler.top_view();
        let mut text = Vec::new();
        write(&mut text, &view).unwrap();
        let text = String::from_utf8(text).unwrap();
        let polygons = culler.model().polygons().len() + culled.occluders;
        assert_eq!(text.matches("<polygon").count(), polygons);
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n"));
        let seen = view.polygons.iter().filter(|p| p.state == State::Visible).count();
        assert_eq!(seen, culled.visible.len());
        let foreseen = culler.foresee(DVec3::new(5.0, 0.0, 0.0), 0.2).unwrap();
        let view = culler.top_view();
        let seen = view.polygons.iter().filter(|p| p.state == State::Visible).count();
        assert_eq!(seen, foreseen.visible.len());
    }
}
