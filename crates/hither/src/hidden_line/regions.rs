//! Lines cut the paper into regions.
//!
//! Lines that end *on* another line, computed in floating point, are made a little longer, so that they do cross it;
//! what then sticks out cuts nothing. Ends that rounding has put apart become one, and an end that is alone is given a
//! hook, which meets also a line that runs beside its own, and bridges to the ends around it: between two that do not
//! meet, what is on one side would leak to the other. Lines too many do no harm: they cut a region in two, which show
//! the same.
//!
//! The paper is halved until few lines are left in a tile, and each tile is cut for itself: so the cost grows like the
//! number of lines, and threads share it. What of a region lies in several tiles is joined again over their borders.

use super::arrangement::{self, Polygon};
use super::crew::Crew;
use super::runs::Runs;
use glam::DVec2;
use std::collections::HashMap;

/// By how much lines are longer at both ends. More than rounding, less than anything that is drawn.
const LONGER: f64 = 1e-6;

/// The side of the cells, pixels, in which all ends become one. More than rounding, less than [`LONGER`].
const SAME: f64 = 1e-7;

/// An end that is alone is joined to those that are so near, pixels, or farther if the caller says so.
const BRIDGED: f64 = 0.01;

/// Whatever the caller says, ends that are farther apart are not joined, pixels.
const FARTHEST_BRIDGED: f64 = 2.0;

/// Of more ends around one that is alone no more than these are joined to it.
const MOST_BRIDGES: usize = 8;

/// A tile is halved if more lines than this are in it, and they become fewer. Drawings in tests have few lines.
const MOST_LINES: usize = if cfg!(test) { 48 } else { 768 };

/// No tile that is narrower than this is halved, pixels.
const LEAST_SIDE: f64 = 1e-3;

/// What the paper is cut into.
pub(super) struct Regions {
    /// The regions, each as what of it is in the tiles.
    pub all: Vec<Vec<Polygon>>,
    /// Where the borders between tiles are, in x and in y, ascending.
    borders: [Vec<f64>; 2],
}

/// Cuts the rectangle from `min` to `max` along the lines. Ends may be apart by as much as `gap` says for a point.
pub(super) fn cut(
    crew: Crew,
    [min, max]: [DVec2; 2],
    lines: impl Iterator<Item = [DVec2; 2]>,
    gap: impl Fn(DVec2) -> f64,
) -> Regions {
    let paper = Tile { min, max, lines: meeting(lines, gap) };
    join(crew.inside(|| paper.cut(crew)))
}

impl Regions {
    /// Takes away corners on borders between tiles at which a contour goes straight on.
    pub fn straighten(&self, contour: &mut Vec<DVec2>) {
        /// How far from the line between its neighbours such a corner may be, pixels.
        const STRAIGHT: f64 = 1e-9;
        let is_on = |p: f64, borders: &[f64]| {
            let next = borders.partition_point(|&b| b < p - on(p));
            borders.get(next).is_some_and(|b| (b - p).abs() <= on(p))
        };
        let n = contour.len();
        let goes_on = |i: usize| {
            let [before, p, after] = [contour[(i + n - 1) % n], contour[i], contour[(i + 1) % n]];
            let (along, way) = (after - before, p - before);
            let (length, at) = (along.length(), way.dot(along));
            (is_on(p.x, &self.borders[0]) || is_on(p.y, &self.borders[1]))
                && way.perp_dot(along).abs() <= STRAIGHT * length
                && 0.0 < at
                && at < length * length
        };
        let stays: Vec<bool> = (0..n).map(|i| !goes_on(i)).collect();
        let mut stays = stays.into_iter();
        contour.retain(|_| stays.next().unwrap_or(true));
    }
}

/// How far from a border a coordinate may be that was on it, pixels.
fn on(border: f64) -> f64 {
    border.abs().max(1e5) * 1e-14
}

/// The lines, made to meet: longer, hooked, and with bridges.
fn meeting(lines: impl Iterator<Item = [DVec2; 2]>, gap: impl Fn(DVec2) -> f64) -> Vec<[DVec2; 2]> {
    let mut ends = Ends::default();
    let name = |line: [DVec2; 2]| {
        let [a, b] = line.map(|end| ends.name(end));
        [a.min(b), a.max(b)]
    };
    let mut named: Vec<[u32; 2]> = lines.map(name).filter(|[a, b]| a != b).collect();
    // Where bodies coincide, so do their lines: their ends are as alone as those of one.
    named.sort_unstable();
    named.dedup();
    // For each end how many lines end there, and the other end of one of them.
    let mut lines_at = vec![(0u32, 0u32); ends.points.len()];
    for &[a, b] in &named {
        for (end, other) in [(a, b), (b, a)] {
            lines_at[end as usize] = (lines_at[end as usize].0 + 1, other);
        }
    }
    let is_alone = |end: u32| lines_at[end as usize].0 == 1;
    let other = |end: u32| is_alone(end).then_some(lines_at[end as usize].1);
    let mut all = bridges(&ends.points, other, gap);
    for [a, b] in named {
        let [from, to] = [a, b].map(|end| ends.points[end as usize]);
        all.push([from, to]);
        let more = (to - from).normalize_or_zero() * LONGER;
        for (name, end, more) in [(a, from, -more), (b, to, more)] {
            let beyond = end + more;
            all.push([end, beyond]);
            // As wide to either side as it is long, so that it crosses whatever passes nearer than that.
            if is_alone(name) {
                all.push([beyond - more.perp(), beyond + more.perp()]);
            }
        }
    }
    all
}

/// Ends of lines: those in a cell of a grid, and in its neighbours nearer than half a cell's side, are one.
#[derive(Default)]
struct Ends {
    points: Vec<DVec2>,
    cells: HashMap<[i64; 2], u32>,
}

impl Ends {
    /// The number of the point that `p` is one with: the first that was met, or itself.
    fn name(&mut self, p: DVec2) -> u32 {
        let cell = |p: DVec2| (p / SAME).floor().to_array().map(|c| c as i64);
        let here = cell(p);
        if let Some(&known) = self.cells.get(&here) {
            return known;
        }
        let half = DVec2::splat(SAME * 0.5);
        let ([left, top], [right, bottom]) = (cell(p - half), cell(p + half));
        let around = [[left, top], [right, top], [left, bottom], [right, bottom]];
        let near = |&known: &u32| self.points[known as usize].distance(p) <= SAME * 0.5;
        let known = around.iter().find_map(|at| self.cells.get(at).copied().filter(near));
        let name = known.unwrap_or(self.points.len() as u32);
        if known.is_none() {
            self.points.push(p);
        }
        self.cells.insert(here, name);
        name
    }
}

/// An end that is alone.
struct Alone {
    end: u32,
    gap: f64,
    /// The direction of its line.
    own: DVec2,
    /// The ends that it is joined to, nearest first.
    to: Vec<u32>,
}

/// Lines from ends that are alone to those around them, `other` being the other end of the line of one that is alone.
/// Of ends in the same direction only the nearest counts, and none on the line itself: lines over one another are cut
/// endlessly.
fn bridges(
    ends: &[DVec2],
    other: impl Fn(u32) -> Option<u32>,
    gap: impl Fn(DVec2) -> f64,
) -> Vec<[DVec2; 2]> {
    /// Of the ends in a cell no more are looked at.
    const MOST_IN_CELL: usize = 64;
    /// The cosine between directions that are the same: less than a thousandth apart.
    const SAME_WAY: f64 = 1.0 - 5e-7;
    let at = |end: u32| ends[end as usize];
    let way = |from: u32, to: u32| (at(to) - at(from)).normalize_or_zero();
    let alone = |end: u32| {
        let own = way(end, other(end)?);
        Some(Alone { end, gap: gap(at(end)).clamp(BRIDGED, FARTHEST_BRIDGED), own, to: Vec::new() })
    };
    let mut waiting: Vec<Alone> = (0..ends.len() as u32).filter_map(alone).collect();
    let mut bridges = Vec::new();
    // Cells grow until there are enough ends in them, or none can be near enough.
    let mut side = BRIDGED;
    while !waiting.is_empty() {
        let cell = |p: DVec2| (p / side).floor().to_array().map(|c| c as i64);
        let mut in_cell: HashMap<[i64; 2], Vec<u32>> = HashMap::new();
        for (i, &end) in ends.iter().enumerate() {
            let list = in_cell.entry(cell(end)).or_default();
            if list.len() < MOST_IN_CELL {
                list.push(i as u32);
            }
        }
        waiting.retain_mut(|Alone { end, gap, own, to }| {
            let [x, y] = cell(at(*end));
            let around = (0..9).filter_map(|k| in_cell.get(&[x + k % 3 - 1, y + k / 3 - 1])).flatten();
            let is_on_line = |step: DVec2| own.dot(step) > 0.0 && own.perp_dot(step).abs() < LONGER;
            let mut near: Vec<(f64, u32)> = around
                .map(|&j| (at(j).distance(at(*end)), j))
                .filter(|&(distance, j)| j != *end && distance <= gap.min(side))
                .filter(|&(_, j)| !is_on_line(at(j) - at(*end)))
                .collect();
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            for (_, j) in near {
                let new = way(*end, j);
                if to.len() < MOST_BRIDGES && to.iter().all(|&t| way(*end, t).dot(new) < SAME_WAY) {
                    to.push(j);
                }
            }
            let goes_on = to.len() < MOST_BRIDGES && *gap > side;
            if !goes_on {
                bridges.extend(to.iter().map(|&j| [j.min(*end), j.max(*end)]));
            }
            goes_on
        });
        side *= 4.0;
    }
    bridges.sort_unstable();
    bridges.dedup();
    bridges.into_iter().map(|bridge| bridge.map(at)).collect()
}

/// A rectangle of the paper and the lines in it.
struct Tile {
    min: DVec2,
    max: DVec2,
    lines: Vec<[DVec2; 2]>,
}

/// A tile that is cut.
struct Cut {
    min: DVec2,
    max: DVec2,
    polygons: Vec<Polygon>,
}

impl Tile {
    fn cut(self, crew: Crew) -> Vec<Cut> {
        let Tile { min, max, .. } = self;
        if let Some([before, after]) = self.halves() {
            let (mut cuts, more) = crew.both(|| before.cut(crew), || after.cut(crew));
            cuts.extend(more);
            return cuts;
        }
        let mut polygons = arrangement::sliced([min, max], &self.lines);
        // What is on the border is there to the last bit, so that it meets what is beyond.
        for p in polygons.iter_mut().flatten().flatten() {
            for axis in 0..2 {
                let border = [min[axis], max[axis]].into_iter().find(|b| (p[axis] - b).abs() <= on(*b));
                p[axis] = border.unwrap_or(p[axis]);
            }
        }
        vec![Cut { min, max, polygons }]
    }

    /// Two tiles instead, if there are too many lines in it and halving makes them fewer.
    fn halves(&self) -> Option<[Tile; 2]> {
        let size = self.max - self.min;
        let axis = usize::from(size.y > size.x);
        if self.lines.len() <= MOST_LINES || size[axis] < LEAST_SIDE {
            return None;
        }
        let at = self.border(axis)?;
        let [mut before, mut after] = [Vec::new(), Vec::new()];
        for &line in &self.lines {
            let [p, q] = line.map(|end| end[axis]);
            if p <= at && q <= at {
                before.push(line);
            } else if p >= at && q >= at {
                after.push(line);
            } else {
                let mut on_border = line[0] + (line[1] - line[0]) * ((at - p) / (q - p));
                on_border[axis] = at;
                let [first, second] = [[line[0], on_border], [on_border, line[1]]];
                let (low, high) = if p < at { (first, second) } else { (second, first) };
                before.push(low);
                after.push(high);
            }
        }
        if 2 * (before.len() + after.len()) > 3 * self.lines.len() {
            return None;
        }
        let (mut left_max, mut right_min) = (self.max, self.min);
        (left_max[axis], right_min[axis]) = (at, at);
        let before = Tile { min: self.min, max: left_max, lines: before };
        Some([before, Tile { min: right_min, max: self.max, lines: after }])
    }

    /// A place near the middle at which no line runs along the border: neither tile would be cut by it.
    fn border(&self, axis: usize) -> Option<f64> {
        /// Shorter lines are what ends are made longer by, pixels.
        const SHORT: f64 = 1e-4;
        /// How near is along, pixels.
        const NEAR: f64 = 1e-5;
        let (from, size) = (self.min[axis], self.max[axis] - self.min[axis]);
        // Not where drawings have lines for a reason.
        let places =
            [0.4987, 0.5139, 0.4721, 0.5413, 0.4449, 0.5687, 0.4177, 0.5971].map(|t| from + t * size);
        let runs_along = |[p, q]: &[DVec2; 2], at: f64| {
            (p[axis] - at).abs() < NEAR && (q[axis] - at).abs() < NEAR && p.distance(*q) > SHORT
        };
        places.into_iter().find(|&at| !self.lines.iter().any(|line| runs_along(line, at)))
    }
}

/// What a polygon has of a border: from where to where, and the polygon's number.
type Stretch = (f64, f64, u32);

/// Joins the polygons of all tiles over the borders between these.
fn join(cuts: Vec<Cut>) -> Regions {
    let mut borders: HashMap<(usize, u64), [Vec<Stretch>; 2]> = HashMap::new();
    let polygons = cuts.iter().flat_map(|cut| cut.polygons.iter().map(move |p| (cut, p)));
    let mut count = 0usize;
    for (number, (cut, polygon)) in (0..).zip(polygons) {
        for contour in polygon {
            for (i, &p) in contour.iter().enumerate() {
                let q = contour[(i + 1) % contour.len()];
                for axis in 0..2 {
                    for (side, border) in [cut.max[axis], cut.min[axis]].into_iter().enumerate() {
                        if p[axis] == border && q[axis] == border {
                            let (a, b) = (p[1 - axis], q[1 - axis]);
                            let sides = borders.entry((axis, border.to_bits())).or_default();
                            sides[side].push((a.min(b), a.max(b), number));
                        }
                    }
                }
            }
        }
        count = number as usize + 1;
    }
    borders.retain(|_, [before, after]| !before.is_empty() && !after.is_empty());
    let mut runs = Runs::new(count);
    borders.values_mut().for_each(|sides| join_over(sides, &mut runs));
    // The first polygon of a region stands before all others of it.
    let mut names: Vec<usize> = Vec::with_capacity(count);
    let mut all: Vec<Vec<Polygon>> = Vec::new();
    for (number, polygon) in cuts.into_iter().flat_map(|cut| cut.polygons).enumerate() {
        let first = runs.first(number as u32) as usize;
        if first == number {
            names.push(all.len());
            all.push(Vec::new());
        } else {
            names.push(names[first]);
        }
        let name = names[number];
        all[name].push(polygon);
    }
    let places = |axis: usize| {
        let mut places: Vec<f64> =
            borders.keys().filter(|key| key.0 == axis).map(|key| f64::from_bits(key.1)).collect();
        places.sort_unstable_by(f64::total_cmp);
        places
    };
    Regions { all, borders: [places(0), places(1)] }
}

/// Joins polygons that have a stretch of a border on either side of it.
fn join_over([before, after]: &mut [Vec<Stretch>; 2], runs: &mut Runs) {
    for side in [&mut *before, &mut *after] {
        side.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    }
    let mut next = 0;
    for &(from, to, ours) in before.iter() {
        while after.get(next).is_some_and(|a| a.1 <= from) {
            next += 1;
        }
        for &(start, end, theirs) in after[next..].iter().take_while(|a| a.0 < to) {
            if to.min(end) - from.max(start) > SAME {
                runs.join(ours, theirs);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::trouble::Random;

    const CREW: Crew = Crew { threads: 1 };

    /// The areas of regions that are not just rounding, from small to large.
    fn areas(regions: &[Vec<Polygon>], least: f64) -> Vec<f64> {
        let all = regions.iter().map(|r| r.iter().map(arrangement::area).sum());
        let mut areas: Vec<f64> = all.filter(|&a| a > least).collect();
        areas.sort_by(f64::total_cmp);
        areas
    }

    #[test]
    fn regions_tile_the_rectangle() {
        let v = DVec2::new;
        let island = [v(2., 2.), v(4., 2.), v(4., 4.), v(2., 4.)];
        let mut lines: Vec<[DVec2; 2]> = (0..4).map(|i| [island[i], island[(i + 1) % 4]]).collect();
        // One that cuts, one that ends on it from below, short by rounding, and one that cuts nothing.
        lines.extend([[v(0., 7.), v(10., 7.)], [v(7., 7. - 1e-13), v(7., 0.)], [v(5., 8.), v(6., 9.)]]);
        let regions = cut(CREW, [v(0., 0.), v(10., 10.)], lines.into_iter(), |_| 0.0).all;
        let areas = areas(&regions, -1.0);
        assert_eq!(areas.len(), 4);
        assert!((areas.iter().sum::<f64>() - 100.0).abs() < 1e-9);
        assert!((areas[0] - 4.0).abs() < 1e-9 && (areas[1] - 21.0).abs() < 1e-9, "{areas:?}");
        assert_eq!(regions.iter().flatten().filter(|p| p.len() == 2).count(), 1);
    }

    #[test]
    fn lines_that_rounding_put_apart_let_nothing_through() {
        let v = DVec2::new;
        let (min, max) = (v(0., 0.), v(10., 10.));
        for slope in [0.0, 0.3, -1.1] {
            let at = |x: f64, off: f64| v(x, 5.0 + slope * (x - 5.0) + off);
            for off in [1e-13, -1e-13, 3e-10, -3e-10] {
                // One goes on where the other ends; and each a way beside the other.
                for [left, right] in [[4.0, 4.0], [4.0 + 1e-12, 4.0], [4.5, 3.5]] {
                    let lines = [[at(-1.0, 0.0), at(left, 0.0)], [at(right, off), at(11.0, off)]];
                    let regions = cut(CREW, [min, max], lines.into_iter(), |_| 0.0).all;
                    let areas = areas(&regions, 1e-6);
                    assert!(areas.len() == 2 && areas[0] > 40.0, "{slope} {off} {left} {right}: {areas:?}");
                }
            }
        }
    }

    #[test]
    fn where_three_lines_almost_meet_nothing_leaks() {
        let v = DVec2::new;
        let middle = v(5.0, 5.0);
        for gap in [5e-6, 1e-4, 0.009, 0.1, 1.5] {
            // Two meet in the middle, the third begins beside it, on what would be the first one's way.
            let lines = [[v(5.0, 11.0), middle], [v(-1.0, 4.0), middle], [v(5.0, 5.0 - gap), v(11.0, 4.5)]];
            let regions = cut(CREW, [v(0., 0.), v(10., 10.)], lines.into_iter(), |_| gap).all;
            let areas = areas(&regions, 1e-3);
            assert!(areas.len() == 3 && areas[2] < 50.0, "{gap}: {areas:?}");
        }
    }

    #[test]
    fn lines_twice_and_lines_too_long_leak_no_more() {
        let v = DVec2::new;
        // One line goes beyond where the others meet, and passes them by 1e-4.
        let lines = [[v(5., 11.), v(5., 5.)], [v(-1., 6.), v(5., 5.)], [v(11., 4.9999), v(4.995, 4.9999)]];
        for times in 1..4 {
            let lines = lines.into_iter().cycle().take(lines.len() * times);
            let regions = cut(CREW, [v(0., 0.), v(10., 10.)], lines, |_| 0.0).all;
            let areas = areas(&regions, 1e-3);
            assert!(areas.len() == 3 && areas[2] < 55.0, "{times} times: {areas:?}");
        }
    }

    #[test]
    fn bridges_do_not_lie_over_one_another() {
        // Sixteen ends in a row, of lines that go away from it.
        let at =
            |k: u32, off: f64| DVec2::new(50.0, 30.0) + DVec2::from_angle(1.34) * (f64::from(k) * 0.05) + off;
        let ends: Vec<DVec2> = (0..16).map(|k| at(k, 0.0)).chain((0..16).map(|k| at(k, 9.0))).collect();
        let other = |end: u32| (end < 16).then_some(end + 16);
        assert_eq!(bridges(&ends, other, |_| 2.0).len(), 15);
    }

    #[test]
    fn tiles_together_are_what_one_cut_gives() {
        let random = &mut Random::new(5);
        let size = DVec2::new(90.0, 60.0);
        let mut lines: Vec<[DVec2; 2]> = Vec::new();
        // Nets of different fineness, and lines at places and of directions that nets have.
        for _ in 0..100 {
            let at = DVec2::new(random.between(0.0, size.x), random.between(0.0, size.y));
            let reach = random.between(0.1, 9.0);
            let corner = |k: u32| at + DVec2::from_angle(f64::from(k)) * reach;
            for k in 0..6 {
                lines.push([corner(k), corner(k + 1)]);
                lines.push([corner(k), at]);
            }
            let (column, row) = (at.x.round(), at.y.round());
            lines.push([DVec2::new(column, 0.0), DVec2::new(column, at.y)]);
            lines.push([DVec2::new(0.0, row), DVec2::new(at.x, row)]);
        }
        let rectangle = [DVec2::ZERO, size];
        let whole = arrangement::sliced(rectangle, &meeting(lines.iter().copied(), |_| 0.0));
        let whole: Vec<Vec<Polygon>> = whole.into_iter().map(|p| vec![p]).collect();
        let regions = cut(CREW, rectangle, lines.into_iter(), |_| 0.0);
        assert!(regions.borders[0].len() + regions.borders[1].len() > 10);
        let (one, tiled) = (areas(&whole, 1e-9), areas(&regions.all, 1e-9));
        assert_eq!(one.len(), tiled.len());
        assert!(one.iter().zip(&tiled).all(|(a, b)| (a - b).abs() < 1e-9));
        let corners =
            |regions: &[Vec<Polygon>]| regions.iter().flatten().flatten().map(Vec::len).sum::<usize>();
        let mut together: Vec<Vec<Polygon>> = regions.all.iter().map(|r| arrangement::merged(r)).collect();
        let bent = corners(&together);
        together.iter_mut().flatten().flatten().for_each(|contour| regions.straighten(contour));
        let straight = corners(&together);
        assert!(
            straight < bent && straight.abs_diff(corners(&whole)) <= straight / 1000,
            "{straight} {bent}"
        );
    }
}
