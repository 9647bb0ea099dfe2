//! Which pieces of lines a pen draws without being lifted.
//!
//! Pieces that end at the same point are joined: at every point ends are paired, the straightest first; one end is
//! left where their number is odd. Closed rounds that share a point with another stroke are taken into it. So a
//! connected figure with 2n odd points takes n strokes, or one if there are none: no drawing of it takes fewer
//! (Euler).
//!
//! Points are named and ends paired band by band of the paper, by several threads; strokes run across bands, and are
//! followed by one.

use super::crew::Crew;
use super::draw::Piece;
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

/// How the ends of pieces are joined. End 2i is the first of piece i, 2i + 1 its second.
pub(super) struct Joints {
    /// The end that each end goes on with, or [`NONE`].
    partner: Vec<u32>,
    /// The ends at each point.
    starts: Vec<u32>,
    ends: Vec<u32>,
}

impl Joints {
    /// Pairs the ends of pieces of one group. Cost: linear, but for points where many meet.
    pub fn of(crew: Crew, pieces: &[Piece]) -> Joints {
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
    pub fn trails(&self, pieces: &[Piece]) -> Vec<Vec<DVec2>> {
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
    /// The point of each end, in steps of 1/[`JOIN_PER_PX`]: y above x. 32 bits hold four times the longest side of a
    /// picture.
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
