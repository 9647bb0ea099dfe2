//! Faces filled with parallel lines, for pens: the darker a face, the closer the lines; cuts at 45 degrees.
//! All lie on one ladder of lines, so that a round surface's facets continue each other's.

use super::arrangement::{self, Polygon};
use super::draw::Piece;
use super::drawing::{Face, Kind};
use glam::DVec2;

/// Faces that are brighter than this stay empty.
const BRIGHTEST: f64 = 0.9;

/// Lines over all faces. `spacing` is the distance of the lines on the darkest, pixels.
pub(super) fn lines(faces: &[Face], spacing: f64) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for face in faces {
        let [r, g, b] = face.color_on_white().map(|c| f64::from(c) / 255.0);
        let bright = 0.3 * r + 0.6 * g + 0.1 * b;
        if !face.cut && bright > BRIGHTEST {
            continue;
        }
        // Twice or four times as far apart where it is brighter: so every line goes on in darker neighbours.
        let apart = if face.cut { spacing } else { spacing * (1.0 + 3.0 * bright).log2().round().exp2() };
        // Neighbouring parts are told apart by the direction.
        let angle = if face.cut || face.part % 2 == 0 { 45f64 } else { 135f64 };
        let along = DVec2::from_angle(angle.to_radians());
        // Turned so that the lines are horizontal.
        let turned: Polygon = face
            .contours
            .iter()
            .map(|c| c.iter().map(|p| DVec2::new(along.dot(*p), along.perp_dot(*p))).collect())
            .collect();
        let heights = || turned.iter().flatten().map(|p| p.y);
        let (low, high) =
            (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let mut line = (low / apart).ceil();
        while line * apart < high {
            let y = line * apart;
            for [from, to] in arrangement::stretches(&turned, y) {
                let back = |x: f64| along * x + along.perp() * y;
                let ends = [back(from), back(to)];
                pieces.push(Piece { ends, part: face.part, kind: Kind::Hatch, covers: 0 });
            }
            line += 1.0;
        }
    }
    pieces
}
