//! Pieces of lines become strokes: as few as possible, and with short ways between them.
//!
//! Within a group (part, covers, kind) pieces that end at the same point are joined. At every point ends are
//! paired, the straightest first; one end is left where their number is odd. Closed rounds that share a point
//! with another stroke are taken into it. So a connected figure with 2n odd points takes n strokes, or one if
//! there are none: no drawing of it takes fewer (Euler).

use super::crew::Crew;
use super::draw::Piece;
use super::drawing::Stroke;
use super::grid::{Places, Sorted};
use super::topology::{Mix, NONE};
use glam::DVec2;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Ends are at the same point if they agree to this part of a pixel.
const JOIN_PER_PX: f64 = 32_768.0;
/// A point nearer to the line between its neighbours, pixels, is left out.
const STRAIGHT_PX: f64 = 1e-5;

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

/// How the ends of pieces are joined. End 2i is the first of piece i, 2i + 1 its second.
struct Joints {
    /// The end that each end goes on with, or [`NONE`].
    partner: Vec<u32>,
    /// The ends at each point.
    starts: Vec<u32>,
    ends: Vec<u32>,
}

impl Joints {
    fn of(crew: Crew, pieces: &[Piece]) -> Joints {
        let bands = Bands::of(crew, pieces);
        let sorted = Sorted::new(crew, bands.count, 1, &bands);
        let partner: Vec<AtomicU32> = (0..bands.keys.len()).map(|_| AtomicU32::new(NONE)).collect();
        let found = crew.map_with(crew.ranges(bands.count, 4), HashMap::default, |names, range| {
            let mut points = Points::default();
            for band in range {
                points.find(sorted.in_cell(band), &bands.keys, names);
            }
            for point in 0..points.starts.len() {
                pair(pieces, points.at(point), &partner);
            }
            points
        });
        let partner = partner.into_iter().map(AtomicU32::into_inner).collect();
        let mut joints = Joints { partner, starts: Vec::new(), ends: Vec::with_capacity(bands.keys.len()) };
        for points in found {
            let before = joints.ends.len() as u32;
            joints.starts.extend(points.starts.iter().map(|s| s + before));
            joints.ends.extend(points.ends);
        }
        joints.starts.push(joints.ends.len() as u32);
        joints.take_in_rounds();
        joints
    }

    fn at(&self, node: usize) -> Range<usize> {
        self.starts[node] as usize..self.starts[node + 1] as usize
    }

    fn link(&mut self, a: u32, b: u32) {
        self.partner[a as usize] = b;
        self.partner[b as usize] = a;
    }

    /// Takes closed rounds into strokes that share a point with them.
    fn take_in_rounds(&mut self) {
        let (mut trail, mut closed) = self.label();
        if !closed.contains(&true) {
            return;
        }
        for node in 0..self.starts.len() - 1 {
            let range = self.at(node);
            if range.len() < 3 {
                continue;
            }
            // Everything at this point joins the stroke of the first end, round by round.
            let ends = &self.ends[range];
            let mut host = *ends.iter().find(|&&e| self.partner[e as usize] == NONE).unwrap_or(&ends[0]);
            for at in 0..ends.len() {
                let guest = self.ends[self.starts[node] as usize + at];
                let root = |trail: &mut Vec<u32>, end: u32| find(trail, end / 2);
                let (h, g) = (root(&mut trail, host), root(&mut trail, guest));
                if h == g || self.partner[guest as usize] == NONE {
                    continue;
                }
                let (host_closed, guest_closed) = (closed[h as usize], closed[g as usize]);
                if !host_closed && !guest_closed {
                    continue;
                }
                let (a, b) = (self.partner[host as usize], self.partner[guest as usize]);
                if a == NONE {
                    if !guest_closed {
                        continue;
                    }
                    // The open end goes on into the round, which now ends here.
                    self.link(host, guest);
                    self.partner[b as usize] = NONE;
                    host = b;
                } else {
                    self.link(host, guest);
                    self.link(a, b);
                }
                trail[g as usize] = h;
                closed[h as usize] = host_closed && guest_closed;
            }
        }
    }

    /// For each piece the first piece of its stroke; and for those, whether it is closed.
    fn label(&self) -> (Vec<u32>, Vec<bool>) {
        let pieces = self.partner.len() / 2;
        let mut trail = vec![NONE; pieces];
        let mut closed = vec![false; pieces];
        for piece in 0..pieces {
            if trail[piece] != NONE {
                continue;
            }
            for start in [2 * piece as u32 + 1, 2 * piece as u32] {
                let mut end = start;
                loop {
                    trail[end as usize / 2] = piece as u32;
                    let next = self.partner[end as usize];
                    if next == NONE {
                        break;
                    }
                    if trail[next as usize / 2] == piece as u32 && next as usize / 2 == piece {
                        closed[piece] = true;
                        break;
                    }
                    end = next ^ 1;
                }
                if closed[piece] {
                    break;
                }
            }
        }
        (trail, closed)
    }

    /// The points of each stroke.
    fn trails(&self, pieces: &[Piece]) -> Vec<Vec<DVec2>> {
        let mut drawn = vec![false; pieces.len()];
        let mut trails = Vec::new();
        let open = (0..self.partner.len()).filter(|&e| self.partner[e] == NONE);
        for start in open.chain((0..pieces.len()).map(|p| 2 * p)) {
            if drawn[start / 2] {
                continue;
            }
            let point = |end: usize| pieces[end / 2].ends[end % 2];
            let mut trail = vec![point(start)];
            let mut end = start;
            loop {
                drawn[end / 2] = true;
                push_straight(&mut trail, point(end ^ 1));
                let next = self.partner[end ^ 1];
                if next == NONE || drawn[next as usize / 2] {
                    break;
                }
                end = next as usize;
            }
            trails.push(trail);
        }
        trails
    }
}

/// Pairs the ends at a point, the straightest first.
fn pair(pieces: &[Piece], ends: &[u32], partner: &[AtomicU32]) {
    let link = |a: u32, b: u32| {
        partner[a as usize].store(b, Relaxed);
        partner[b as usize].store(a, Relaxed);
    };
    if let [a, b] = *ends {
        link(a, b);
    }
    if ends.len() < 3 {
        return;
    }
    let away = |end: u32| {
        let ends = pieces[end as usize / 2].ends;
        let (here, there) = (ends[end as usize % 2], ends[1 - end as usize % 2]);
        (there - here).normalize_or_zero()
    };
    let mut left: Vec<(u32, DVec2)> = ends.iter().map(|&e| (e, away(e))).collect();
    // A crowd is paired as it comes: looking for the best would take its square.
    let crowd = left.len() > 64;
    while left.len() > 1 {
        let mut best = (0, 1, f64::INFINITY);
        for i in 0..left.len() {
            for j in i + 1..left.len() {
                let bend = left[i].1.dot(left[j].1);
                if bend < best.2 {
                    best = (i, j, bend);
                }
            }
            if crowd {
                break;
            }
        }
        let (i, j, _) = best;
        link(left[i].0, left[j].0);
        left.swap_remove(j);
        left.swap_remove(i);
    }
}

/// Ends of pieces by bands of the paper, so narrow that what is known of a band fits the processor's caches.
struct Bands {
    /// The point of each end, in steps of [`JOIN_PER_PX`]: y above x.
    keys: Vec<u64>,
    top: i32,
    per_step: f64,
    count: usize,
}

impl Bands {
    /// Ends in a band, on average.
    const ENDS: usize = 4096;

    fn of(crew: Crew, pieces: &[Piece]) -> Bands {
        let mut keys = Vec::new();
        crew.extend(&mut keys, pieces.len() * 2, |end| {
            let [x, y] = (pieces[end / 2].ends[end % 2] * JOIN_PER_PX).round().to_array();
            u64::from(y as i32 as u32) << 32 | u64::from(x as i32 as u32)
        });
        let (mut top, mut bottom) = (i32::MAX, i32::MIN);
        for key in &keys {
            (top, bottom) = (top.min(y_of(*key)), bottom.max(y_of(*key)));
        }
        let count = keys.len() / Bands::ENDS + 1;
        let per_step = count as f64 / (f64::from(bottom) - f64::from(top) + 1.0);
        Bands { keys, top, per_step, count }
    }
}

fn y_of(key: u64) -> i32 {
    (key >> 32) as u32 as i32
}

impl Places for Bands {
    #[inline(always)]
    fn visit(&self, bands: &Range<usize>, mut visit: impl FnMut(usize, usize)) {
        for (end, &key) in self.keys.iter().enumerate() {
            let band = ((f64::from(y_of(key)) - f64::from(self.top)) * self.per_step) as usize;
            let band = band.min(self.count - 1);
            if bands.contains(&band) {
                visit(band - bands.start, end);
            }
        }
    }
}

/// The ends at each point of some bands.
#[derive(Default)]
struct Points {
    starts: Vec<u32>,
    ends: Vec<u32>,
}

impl Points {
    /// Adds the points of a band. `names` is emptied first.
    fn find(&mut self, ends: &[u32], keys: &[u64], names: &mut HashMap<u64, u32, Mix>) {
        names.clear();
        let before = self.ends.len() as u32;
        let first = self.starts.len();
        let point_of: Vec<u32> = ends
            .iter()
            .map(|&end| {
                let fresh = names.len() as u32;
                let point = *names.entry(keys[end as usize]).or_insert(fresh);
                if point == fresh {
                    self.starts.push(0);
                }
                self.starts[first + point as usize] += 1;
                point
            })
            .collect();
        let mut sum = before;
        for start in &mut self.starts[first..] {
            sum += std::mem::replace(start, sum);
        }
        let mut next = self.starts[first..].to_vec();
        self.ends.resize(sum as usize, 0);
        for (&end, &point) in ends.iter().zip(&point_of) {
            let at = &mut next[point as usize];
            self.ends[*at as usize] = end;
            *at += 1;
        }
    }

    fn at(&self, point: usize) -> &[u32] {
        let end = self.starts.get(point + 1).map_or(self.ends.len(), |&end| end as usize);
        &self.ends[self.starts[point] as usize..end]
    }
}

/// The representative of a piece's stroke, with the path to it shortened.
fn find(trail: &mut [u32], piece: u32) -> u32 {
    let mut at = piece;
    while trail[at as usize] != at {
        trail[at as usize] = trail[trail[at as usize] as usize];
        at = trail[at as usize];
    }
    at
}

/// Adds a point; the last one is replaced where it is on the way.
fn push_straight(trail: &mut Vec<DVec2>, p: DVec2) {
    if let [.., a, m] = trail[..] {
        let (step, way) = (m - a, p - a);
        if step.perp_dot(way).abs() <= STRAIGHT_PX * way.length() && step.dot(p - m) > 0.0 {
            trail.pop();
        }
    }
    trail.push(p);
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
