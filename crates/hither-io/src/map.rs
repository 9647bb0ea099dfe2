//! Top views of what occluder planes hide, as SVG, in the manner of Coorg & Teller's figures 10 and 11.
//!
//! Green: hidden. Orange: some of it may be hidden. Cyan: visible. Blue: outside the view. Black: the occluders in
//! use. Yellow: the leaf that holds the eye; red: the eye. Tinted areas are the tree's boxes, lines the polygons. A
//! strip below says so.

use crate::{Error, write_whole};
use glam::DVec2;
use hither::cull::planes::{State, TopView};
use std::io::{self, Write};
use std::path::Path;

/// Longer side of the picture, in SVG units.
const SIDE: f64 = 1200.0;
/// Room around the plan.
const MARGIN: f64 = 20.0;
/// Rows of the legend, and what an entry is wide.
const ROW: f64 = 24.0;
const ENTRY: f64 = 165.0;

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
        State::Partial => ("#ffd9b0", "#d9730d"),
        State::Visible => ("#b5ecf0", "#0793a3"),
    }
}

fn write(file: &mut dyn Write, view: &TopView) -> io::Result<()> {
    let all = view.polygons.iter().flat_map(|p| &p.corners).chain([&view.eye]);
    let (min, max) = all.fold((view.eye, view.eye), |(min, max), p| (min.min(*p), max.max(*p)));
    let scale = SIDE / (max - min).max_element().max(1e-9);
    let sheet = Sheet { origin: min, scale };
    let plan = (max - min) * scale + 2.0 * MARGIN;
    let columns = ((plan.x - 2.0 * MARGIN) / ENTRY).floor().clamp(1.0, LEGEND.len() as f64) as usize;
    let rows = LEGEND.len().div_ceil(columns) as f64;
    // Wide enough for an entry, however narrow the plan is.
    let size = DVec2::new(plan.x.max(ENTRY + 2.0 * MARGIN), plan.y + rows * ROW + 0.5 * MARGIN);
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
    for wanted in [State::Outside, State::Hidden, State::Partial, State::Visible] {
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
    legend(file, plan.y, columns)?;
    writeln!(file, "</svg>")
}

/// What a legend's entry shows.
enum Sample {
    Of(State),
    Occluder,
    Leaf,
    Eye,
}

const LEGEND: [(Sample, &str); 7] = [
    (Sample::Of(State::Hidden), "hidden"),
    (Sample::Of(State::Partial), "partial"),
    (Sample::Of(State::Visible), "visible"),
    (Sample::Of(State::Outside), "outside the view"),
    (Sample::Occluder, "active occluder"),
    (Sample::Leaf, "the eye\u{2019}s leaf"),
    (Sample::Eye, "the eye"),
];

/// Writes what the colours mean into a strip that begins at `top`.
fn legend(file: &mut dyn Write, top: f64, columns: usize) -> io::Result<()> {
    writeln!(file, r#"<g font-family="sans-serif" font-size="15" stroke-width="1.2">"#)?;
    for (i, (sample, text)) in LEGEND.iter().enumerate() {
        let (column, row) = (i % columns, i / columns);
        let (x, y) = (MARGIN + column as f64 * ENTRY, top + row as f64 * ROW);
        let square = format!(r#"<rect x="{x:.1}" y="{y:.1}" width="16" height="16""#);
        match sample {
            Sample::Of(state) => {
                let (fill, stroke) = colors(*state);
                writeln!(file, r#"{square} fill="{fill}" stroke="{stroke}"/>"#)?;
            }
            Sample::Occluder => writeln!(file, r#"{square} fill="none" stroke="black" stroke-width="3"/>"#)?,
            Sample::Leaf => writeln!(file, r##"{square} fill="#ffe94a"/>"##)?,
            Sample::Eye => {
                writeln!(
                    file,
                    r##"<circle cx="{:.1}" cy="{:.1}" r="5" fill="#d40000"/>"##,
                    x + 8.0,
                    y + 8.0
                )?;
            }
        }
        writeln!(file, r#"<text x="{:.1}" y="{:.1}">{text}</text>"#, x + 24.0, y + 13.5)?;
    }
    writeln!(file, "</g>")
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hither::cull::planes::{PlaneCuller, PlanesOptions};

    fn may_be_seen(view: &TopView) -> usize {
        let seen = |state| matches!(state, State::Visible | State::Partial);
        view.polygons.iter().filter(|p| seen(p.state)).count()
    }

    #[test]
    fn every_state_has_its_color_and_its_entry_in_the_legend() {
        let states = [State::Outside, State::Hidden, State::Partial, State::Visible];
        let polygon = |(i, state)| {
            let x = f64::from(i);
            let corners = vec![DVec2::new(x, 0.0), DVec2::new(x + 1.0, 0.0), DVec2::new(x, 2.0)];
            hither::cull::planes::TopViewPolygon { corners, state }
        };
        let view = TopView { polygons: (0..).zip(states).map(polygon).collect(), ..TopView::default() };
        let mut text = Vec::new();
        write(&mut text, &view).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!((text.matches("<polygon").count(), text.matches("<text").count()), (4, LEGEND.len()));
        for state in states {
            let (_, stroke) = colors(state);
            // Once around the polygons, once in the legend.
            assert_eq!(text.matches(&format!("stroke=\"{stroke}\"")).count(), 2, "{state:?}");
        }
        // A plan without width has room for its legend all the same.
        let mut narrow = Vec::new();
        write(&mut narrow, &TopView::default()).unwrap();
        assert!(String::from_utf8(narrow).unwrap().contains(r#"width="205.0""#));
    }

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
        let seen = may_be_seen(&view);
        assert_eq!(seen, culled.visible.len());
        let foreseen = culler.foresee(DVec3::new(5.0, 0.0, 0.0), 0.2).unwrap();
        let view = culler.top_view();
        let seen = may_be_seen(&view);
        assert_eq!(seen, foreseen.visible.len());
    }
}
