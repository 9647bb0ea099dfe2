//! Pieces of lines become strokes: as few as possible, and with short ways between them.
//!
//! `joints` joins the pieces of a group (part, covers, kind); here the strokes are put into an order.

use super::crew::Crew;
use super::draw::Piece;
use super::drawing::Stroke;
use super::joints::Joints;
use glam::DVec2;

/// Joins all pieces; returns the points and the strokes, grouped.
pub(super) fn join(crew: Crew, mut pieces: Vec<Piece>) -> (Vec<DVec2>, Vec<Stroke>) {
    let group = |p: &Piece| (p.part, p.covers, p.kind);
    if !pieces.is_sorted_by_key(group) {
        crew.sort_by_key(&mut pieces, group);
    }
    let mut points = Vec::new();
    let mut strokes = Vec::new();
    let runs: Vec<&[Piece]> = pieces.chunk_by(|a, b| group(a) == group(b)).collect();
    let joined = crew.map(runs.clone(), |run| {
        let mut trails = Joints::of(crew, run).trails(run);
        order(&mut trails);
        trails
    });
    for (run, trails) in runs.into_iter().zip(joined) {
        for trail in trails {
            let start = points.len() as u32;
            points.extend(trail);
            let Piece { part, kind, covers, .. } = run[0];
            strokes.push(Stroke { part, kind, covers, points: start..points.len() as u32 });
        }
    }
    (points, strokes)
}

/// Puts strokes into an order, and turns them, so that the pen travels little: always on to the nearest end
/// that is near, else on to the next place along the paper.
fn order(trails: &mut Vec<Vec<DVec2>>) {
    if trails.len() < 3 {
        return;
    }
    let mut nearby = Nearby::new(trails);
    let mut ordered = Vec::with_capacity(trails.len());
    let mut pen = DVec2::ZERO;
    while let Some((index, turned)) = nearby.take(pen) {
        let mut trail = std::mem::take(&mut trails[index as usize]);
        if turned {
            trail.reverse();
        }
        pen = trail[trail.len() - 1];
        ordered.push(trail);
    }
    *trails = ordered;
}

/// Ends of strokes by cell.
struct Nearby {
    min: DVec2,
    per_px: f64,
    side: i64,
    cells: Vec<Vec<(u32, bool, DVec2)>>,
    taken: Vec<bool>,
    next: usize,
    starts: Vec<DVec2>,
}

impl Nearby {
    /// How far around the pen is looked for an end, cells.
    const FAR: i64 = 3;

    fn new(trails: &[Vec<DVec2>]) -> Nearby {
        let ends = |t: &Vec<DVec2>| [t[0], t[t.len() - 1]];
        let min = trails.iter().flat_map(ends).fold(DVec2::INFINITY, DVec2::min);
        let max = trails.iter().flat_map(ends).fold(DVec2::NEG_INFINITY, DVec2::max);
        let side = ((trails.len() as f64).sqrt() as i64).clamp(1, 1024);
        let per_px = side as f64 / (max - min).max_element().max(1e-9);
        let mut nearby = Nearby {
            min,
            per_px,
            side,
            cells: vec![Vec::new(); (side * side) as usize],
            taken: vec![false; trails.len()],
            next: 0,
            starts: trails.iter().map(|t| t[0]).collect(),
        };
        for (i, t) in trails.iter().enumerate() {
            for (turned, end) in ends(t).into_iter().enumerate() {
                let [x, y] = nearby.cell(end);
                nearby.cells[(y * side + x) as usize].push((i as u32, turned == 1, end));
            }
        }
        nearby
    }

    fn cell(&self, p: DVec2) -> [i64; 2] {
        ((p - self.min) * self.per_px).to_array().map(|c| (c as i64).clamp(0, self.side - 1))
    }

    /// The stroke to draw next, and whether from its end.
    fn take(&mut self, pen: DVec2) -> Option<(u32, bool)> {
        let [cx, cy] = self.cell(pen);
        let mut best: Option<(f64, u32, bool)> = None;
        for ring in 0..=Self::FAR {
            for y in (cy - ring).max(0)..=(cy + ring).min(self.side - 1) {
                for x in (cx - ring).max(0)..=(cx + ring).min(self.side - 1) {
                    if (x - cx).abs().max((y - cy).abs()) != ring {
                        continue;
                    }
                    let taken = &self.taken;
                    let cell = &mut self.cells[(y * self.side + x) as usize];
                    cell.retain(|e| !taken[e.0 as usize]);
                    for &(i, turned, end) in cell.iter() {
                        let way = end.distance_squared(pen);
                        if best.is_none_or(|b| (way, i, turned) < b) {
                            best = Some((way, i, turned));
                        }
                    }
                }
            }
            if best.is_some() && ring > 0 {
                break;
            }
        }
        let (index, turned) = match best {
            Some((_, i, turned)) => (i, turned),
            None => {
                while self.next < self.taken.len() && self.taken[self.next] {
                    self.next += 1;
                }
                self.starts.get(self.next)?;
                (self.next as u32, false)
            }
        };
        self.taken[index as usize] = true;
        Some((index, turned))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Crew = Crew { threads: 1 };
    use crate::hidden_line::Kind;

    fn figure(segments: &[([f64; 2], [f64; 2])]) -> Vec<Piece> {
        let piece = |&(a, b): &([f64; 2], [f64; 2])| Piece {
            ends: [a.into(), b.into()],
            part: 0,
            kind: Kind::Crease,
            covers: 0,
        };
        segments.iter().map(piece).collect()
    }

    fn length(points: &[DVec2], strokes: &[Stroke]) -> f64 {
        let of = |s: &Stroke| {
            let p = &points[s.points.start as usize..s.points.end as usize];
            p.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>()
        };
        strokes.iter().map(of).sum()
    }

    #[test]
    fn a_square_is_one_closed_stroke_of_five_points() {
        let (points, strokes) = join(
            ONE,
            figure(&[
                ([0., 0.], [1., 0.]),
                ([1., 0.], [2., 0.]),
                ([2., 2.], [2., 0.]),
                ([2., 2.], [0., 2.]),
                ([0., 0.], [0., 2.]),
            ]),
        );
        assert_eq!(strokes.len(), 1);
        assert_eq!(points.len(), 5);
        assert_eq!(points[0], points[4]);
    }

    #[test]
    fn rounds_that_touch_are_one_stroke() {
        // Three triangles in a chain, each sharing a corner with the next: all points are even.
        let mut segments = Vec::new();
        for k in 0..3 {
            let x = 2.0 * f64::from(k);
            segments.push(([x, 0.], [x + 2., 0.]));
            segments.push(([x + 2., 0.], [x + 1., 1.]));
            segments.push(([x + 1., 1.], [x, 0.]));
        }
        let (points, strokes) = join(ONE, figure(&segments));
        assert_eq!(strokes.len(), 1);
        assert!((length(&points, &strokes) - 3.0 * (2.0 + 2.0 * 2f64.sqrt())).abs() < 1e-9);
    }

    #[test]
    fn a_cube_takes_four_strokes() {
        // The graph of a cube has eight points of degree three.
        let at = |i: u32| {
            [f64::from(i & 1) + 0.3 * f64::from(i >> 2), f64::from(i >> 1 & 1) + 0.2 * f64::from(i >> 2)]
        };
        let mut segments = Vec::new();
        for i in 0..8u32 {
            for axis in 0..3 {
                if i >> axis & 1 == 0 {
                    segments.push((at(i), at(i | 1 << axis)));
                }
            }
        }
        let total: f64 = segments.iter().map(|(a, b)| DVec2::from(*a).distance(DVec2::from(*b))).sum();
        let (points, strokes) = join(ONE, figure(&segments));
        assert_eq!(strokes.len(), 4);
        assert!((length(&points, &strokes) - total).abs() < 1e-9);
    }

    #[test]
    fn an_open_end_goes_on_into_a_round() {
        let (_, strokes) = join(
            ONE,
            figure(&[
                ([-1., 0.], [0., 0.]),
                ([0., 0.], [1., 1.]),
                ([1., 1.], [1., -1.]),
                ([1., -1.], [0., 0.]),
            ]),
        );
        assert_eq!(strokes.len(), 1);
    }

    #[test]
    fn the_pen_travels_little() {
        let mut segments = Vec::new();
        for k in 0..100u32 {
            let y = f64::from((k * 37) % 100);
            segments.push(([0., y], [5., y]));
        }
        let (points, strokes) = join(ONE, figure(&segments));
        let mut pen = DVec2::ZERO;
        let mut travel = 0.0;
        for s in &strokes {
            travel += pen.distance(points[s.points.start as usize]);
            pen = points[s.points.end as usize - 1];
        }
        assert!(travel < 150.0, "{travel}");
    }
}
