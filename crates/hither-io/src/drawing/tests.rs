//! What the writers write is what was drawn.

use super::*;
use hither::hidden_line::{Face, Kind, Stroke};

fn fixed(value: i64, digits: usize) -> String {
    let mut text = Vec::new();
    push_fixed(&mut text, value, digits);
    String::from_utf8(text).unwrap()
}

#[test]
fn numbers_have_no_needless_digits() {
    let texts: Vec<String> = [0, 5, -5, 50, 120, 12345, -100, 100_000, -7].map(|v| fixed(v, 2)).into();
    assert_eq!(texts, ["0", ".05", "-.05", ".5", "1.2", "123.45", "-1", "1000", "-.07"]);
    assert_eq!(fixed(7, 3), ".007");
}

fn drawing() -> Drawing {
    let points = [[0.0, 0.0], [10.0, 0.0], [10.0, 5.5], [3.0, 3.0], [4.0, 4.0]].map(DVec2::from).to_vec();
    Drawing {
        width: 20.0,
        height: 10.0,
        points,
        strokes: vec![
            Stroke { part: 0, kind: Kind::Silhouette, covers: 0, points: 0..3 },
            Stroke { part: 1, kind: Kind::Crease, covers: 2, points: 3..5 },
        ],
        faces: vec![Face {
            part: 1,
            through: Vec::new(),
            opacity: 1.0,
            triangle: 4,
            cut: false,
            color: [255, 0, 16],
            contours: vec![[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]].map(DVec2::from).to_vec()],
        }],
        ..Drawing::default()
    }
}

fn written(write: impl Fn(&Path, &Sheet) -> Result<(), Error>, extension: &str) -> String {
    let path = std::env::temp_dir().join(format!("hither-drawing-{}.{extension}", std::process::id()));
    let drawing = drawing();
    let names = ["a<b>&\"c\"".to_owned()];
    let view =
        SheetView { name: "front".into(), drawing: &drawing, origin: DVec2::new(1.0, 2.0), scale: 2.0 };
    let sheet = Sheet {
        title: "test",
        width: 50.0,
        height: 30.0,
        unit: Unit::Millimetre,
        views: vec![view],
        part_names: &names,
        style: "path > .a { stroke: red }\n/* </style> & ]]> */",
    };
    write(&path, &sheet).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    text
}

use crate::Error;
use std::path::Path;

#[test]
fn svg_has_groups_and_classes() {
    let text = written(write_svg, "svg");
    assert!(
        text.contains("path &gt; .a { stroke: red }\n/* &lt;/style&gt; &amp; ]]&gt; */</style>\n"),
        "a stylesheet is text"
    );
    assert!(text.contains("width=\"50mm\" height=\"30mm\" viewBox=\"0 0 50 30\""), "{text}");
    assert!(text.contains("data-part=\"0\" data-name=\"a&lt;b&gt;&amp;&quot;c&quot;\""));
    assert!(text.contains("<path class=\"visible silhouette\" d=\"M1 2l20 0 0 11\"/>"), "{text}");
    assert!(text.contains("<path class=\"hidden crease\" data-covers=\"2\" d=\"M7 8l2 2\"/>"));
    assert!(text.contains("fill:#ff0010") && text.contains("M1 2l2 0 0 2z"));
    assert!(text.ends_with("</svg>\n"));
}

#[test]
fn dxf_has_layers_and_polylines_with_y_up() {
    let text = written(write_dxf, "dxf");
    assert!(text.contains("POLYLINE\n8\nVISIBLE_SILHOUETTE\n"));
    assert!(text.contains("VERTEX\n8\nHIDDEN_CREASE\n10\n7.000000\n20\n22.000000\n"), "{text}");
    let solid = "SOLID\n8\nFACES\n62\n10\n10\n";
    assert_eq!(text.matches(solid).count(), 1, "{text}");
    assert!(text.contains("POLYLINE\n8\nFACE_OUTLINES\n62\n10\n66\n1\n70\n1\n"));
    assert!(text.find("SOLID") < text.find("VISIBLE_SILHOUETTE\n66"));
    assert!(text.ends_with("0\nENDSEC\n0\nEOF\n"));
}

#[test]
fn json_can_be_read_back() {
    let json: serde_json::Value = serde_json::from_str(&written(write_drawing_json, "json")).unwrap();
    assert_eq!(json["views"][0]["strokes"][0]["points"][2], serde_json::json!([21, 13]));
    assert_eq!(json["views"][0]["strokes"][1]["covers"], 2);
    assert_eq!(json["views"][0]["faces"][0]["contours"][0][1], serde_json::json!([3, 2]));
}
