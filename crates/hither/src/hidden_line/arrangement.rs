//! Lines cut the plane into regions: polygons with holes that tile a rectangle exactly.
//!
//! The cutting itself is `i_overlay`'s: coordinates go to a grid of 62-bit integers, crossings are snapped to
//! it, and every predicate is exact. What is done here: lines that end *on* another line, computed in
//! floating point, are made a little longer, so that they do cross it; what then sticks out cuts nothing. Ends that
//! rounding has put apart become one, and an end that is alone is given a hook, which meets also a line that runs beside
//! its own, and bridges to the ends around it: between two that do not meet, what is on one side would leak to the
//! other. Lines too many do no harm: they cut a region in two, which show the same.

use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::float::simplify::SimplifyShape;
use i_overlay::float::slice::FloatSlice;
use i_triangle::float::triangulatable::Triangulatable;
use std::collections::HashMap;

/// By how much lines are longer at both ends. More than rounding, less than anything that is drawn.
const LONGER: f64 = 1e-6;

/// The side of the cells, pixels, in which all ends become one. More than rounding, less than [`LONGER`].
const SAME: f64 = 1e-7;

/// An end that is alone is joined to those that are so near, pixels, or nearer than the caller says.
const BRIDGED: f64 = 0.01;

/// The farthest that the caller may say, pixels.
const FARTHEST_BRIDGED: f64 = 2.0;

/// Of more ends around one that is alone no more than these are joined to it.
const MOST_BRIDGES: usize = 8;

/// A polygon: its outline, then its holes. Closed, without repeating the first point.
pub(super) type Polygon = Vec<Vec<DVec2>>;

/// Cuts the rectangle from `min` to `max` along the lines. Ends may be apart by as much as `gap` says for a point.
pub(super) fn cut(
    [min, max]: [DVec2; 2],
    lines: impl Iterator<Item = [DVec2; 2]>,
    gap: impl Fn(DVec2) -> f64,
) -> Vec<Polygon> {
    let outline = vec![[min.x, min.y], [max.x, min.y], [max.x, max.y], [min.x, max.y]];
    let mut ends = Ends::default();
    let lines: Vec<[u32; 2]> = lines.map(|line| line.map(|end| ends.name(end))).collect();
    let mut lines_at = vec![0u32; ends.points.len()];
    lines.iter().filter(|[a, b]| a != b).flatten().for_each(|&end| lines_at[end as usize] += 1);
    let is_alone = |end: u32| lines_at[end as usize] == 1;
    let bridges = bridges(&ends.points, is_alone, gap);
    let paths: Vec<Vec<[f64; 2]>> = lines
        .into_iter()
        .filter(|[a, b]| a != b)
        .map(|[a, b]| {
            let [from, to] = [a, b].map(|end| ends.points[end as usize]);
            let more = (to - from).normalize_or_zero() * LONGER;
            let mut path = beyond(from, -more, is_alone(a));
            path.extend([from, to]);
            path.extend(beyond(to, more, is_alone(b)).into_iter().rev());
            path.into_iter().map(|p| p.to_array()).collect()
        })
        .chain(bridges.iter().map(|bridge| bridge.map(|p| p.to_array()).to_vec()))
        .collect();
    if paths.is_empty() {
        return vec![vec![outline.into_iter().map(DVec2::from).collect()]];
    }
    polygons(outline.slice_by_as::<i64>(&paths, FillRule::EvenOdd))
}

/// How a line goes on beyond an end, from the outside in: by `more`, or in a hook that is as wide to either side, so that
/// it crosses whatever passes nearer than that, in any direction.
fn beyond(end: DVec2, more: DVec2, hooked: bool) -> Vec<DVec2> {
    let aside = more.perp();
    if hooked { vec![end + more - aside, end + more + aside] } else { vec![end + more] }
}

/// Lines from ends that are alone to those around them.
fn bridges(ends: &[DVec2], is_alone: impl Fn(u32) -> bool, gap: impl Fn(DVec2) -> f64) -> Vec<[DVec2; 2]> {
    /// Of the ends in a cell no more are looked at.
    const MOST_IN_CELL: usize = 64;
    let alone = ends.iter().enumerate().filter(|&(i, _)| is_alone(i as u32));
    let mut alone: Vec<(u32, f64)> =
        alone.map(|(i, &end)| (i as u32, gap(end).clamp(BRIDGED, FARTHEST_BRIDGED))).collect();
    let mut bridges = Vec::new();
    // Cells grow until there are enough ends in them, or none can be near enough.
    let mut side = BRIDGED;
    while !alone.is_empty() {
        let cell = |p: DVec2| (p / side).floor().to_array().map(|c| c as i64);
        let mut in_cell: HashMap<[i64; 2], Vec<u32>> = HashMap::new();
        for (i, &end) in ends.iter().enumerate() {
            let list = in_cell.entry(cell(end)).or_default();
            if list.len() < MOST_IN_CELL {
                list.push(i as u32);
            }
        }
        alone.retain(|&(i, gap)| {
            let end = ends[i as usize];
            let [x, y] = cell(end);
            let around = (0..9).filter_map(|k| in_cell.get(&[x + k % 3 - 1, y + k / 3 - 1])).flatten();
            let mut near: Vec<(f64, u32)> = around
                .map(|&j| (ends[j as usize].distance(end), j))
                .filter(|&(distance, j)| j != i && distance <= gap.min(side))
                .collect();
            if near.len() < MOST_BRIDGES && gap > side {
                return true;
            }
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            bridges.extend(near.iter().take(MOST_BRIDGES).map(|&(_, j)| [end, ends[j as usize]]));
            false
        });
        side *= 4.0;
    }
    bridges
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

/// The polygons together, without the lines between those that share an edge.
pub(super) fn merged(parts: &[Polygon]) -> Vec<Polygon> {
    let shapes: Vec<Vec<Vec<[f64; 2]>>> =
        parts.iter().map(|p| p.iter().map(|c| c.iter().map(|v| v.to_array()).collect()).collect()).collect();
    polygons(shapes.simplify_shape_as::<i64>(FillRule::EvenOdd))
}

/// What closed contours enclose: where their winding number is not 0, or else where it is odd.
pub(super) fn enclosed(contours: &Polygon, winding: bool) -> Vec<Polygon> {
    let contours: Vec<Vec<[f64; 2]>> =
        contours.iter().map(|c| c.iter().map(|v| v.to_array()).collect()).collect();
    let rule = if winding { FillRule::NonZero } else { FillRule::EvenOdd };
    polygons(contours.simplify_shape_as::<i64>(rule))
}

/// A polygon as triangles, counter-clockwise if +y is up.
pub(super) fn triangles(polygon: &Polygon) -> Vec<[DVec2; 3]> {
    let contours: Vec<Vec<[f64; 2]>> =
        polygon.iter().map(|c| c.iter().map(|v| v.to_array()).collect()).collect();
    let mesh = contours.triangulate_as::<i64>().to_triangulation::<u32>();
    let (corners, _) = mesh.indices.as_chunks::<3>();
    corners.iter().map(|t| t.map(|i| DVec2::from(mesh.points[i as usize]))).collect()
}

fn polygons(shapes: Vec<Vec<Vec<[f64; 2]>>>) -> Vec<Polygon> {
    let polygon = |shape: Vec<Vec<[f64; 2]>>| -> Polygon {
        shape.into_iter().map(|c| c.into_iter().map(DVec2::from).collect()).collect()
    };
    shapes.into_iter().map(polygon).collect()
}

/// Points well inside a polygon, first the middle of the widest stretch on some horizontal lines through it, last what is
/// nearer to the ends of stretches. None if it is too thin to have one.
pub(super) fn points_inside(polygon: &Polygon) -> Vec<DVec2> {
    /// Horizontal lines that are tried.
    const LINES: usize = 7;
    let mut heights: Vec<f64> = polygon.iter().flatten().map(|p| p.y).collect();
    heights.sort_unstable_by(f64::total_cmp);
    heights.dedup();
    let mut bands: Vec<[f64; 2]> = heights.windows(2).map(|w| [w[0], w[1]]).collect();
    bands.sort_by(|a, b| (b[1] - b[0]).total_cmp(&(a[1] - a[0])));
    let mut found: Vec<(f64, [DVec2; 3])> = Vec::new();
    for [low, high] in bands.into_iter().take(LINES) {
        let y = 0.5 * (low + high);
        for [from, to] in stretches(polygon, y) {
            let room = (to - from).min(high - low);
            if room > 0.0 {
                found.push((room, [0.5, 0.1, 0.9].map(|t| DVec2::new(from + (to - from) * t, y))));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let place = |k: usize| found.iter().map(move |(_, points)| points[k]);
    place(0).chain(place(1)).chain(place(2)).collect()
}

/// Where a horizontal line is inside a polygon, from left to right.
pub(super) fn stretches(polygon: &Polygon, y: f64) -> Vec<[f64; 2]> {
    let mut crossings = Vec::new();
    for contour in polygon {
        for (i, &p) in contour.iter().enumerate() {
            let q = contour[(i + 1) % contour.len()];
            if (p.y <= y) != (q.y <= y) {
                crossings.push(p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y)));
            }
        }
    }
    crossings.sort_unstable_by(f64::total_cmp);
    crossings.chunks_exact(2).map(|c| [c[0], c[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &Polygon) -> f64 {
        let twice = |c: &Vec<DVec2>| -> f64 {
            (0..c.len()).map(|i| c[i].perp_dot(c[(i + 1) % c.len()])).sum::<f64>().abs()
        };
        (twice(&polygon[0]) - polygon[1..].iter().map(twice).sum::<f64>()) * 0.5
    }

    #[test]
    fn regions_tile_the_rectangle() {
        let v = DVec2::new;
        let island = [v(2., 2.), v(4., 2.), v(4., 4.), v(2., 4.)];
        let mut lines: Vec<[DVec2; 2]> = (0..4).map(|i| [island[i], island[(i + 1) % 4]]).collect();
        // One that cuts, one that ends on it from below, short by rounding, and one that cuts nothing.
        lines.extend([[v(0., 7.), v(10., 7.)], [v(7., 7. - 1e-13), v(7., 0.)], [v(5., 8.), v(6., 9.)]]);
        let regions = cut([v(0., 0.), v(10., 10.)], lines.into_iter(), |_| 0.0);
        let mut areas: Vec<f64> = regions.iter().map(area).collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas.len(), 4);
        assert!((areas.iter().sum::<f64>() - 100.0).abs() < 1e-9);
        assert!((areas[0] - 4.0).abs() < 1e-9 && (areas[1] - 21.0).abs() < 1e-9, "{areas:?}");
        assert_eq!(regions.iter().filter(|r| r.len() == 2).count(), 1);
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
                    let regions = cut([min, max], lines.into_iter(), |_| 0.0);
                    let mut areas: Vec<f64> = regions.iter().map(area).filter(|a| *a > 1e-6).collect();
                    areas.sort_by(f64::total_cmp);
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
            let regions = cut([v(0., 0.), v(10., 10.)], lines.into_iter(), |_| gap);
            let mut areas: Vec<f64> = regions.iter().map(area).filter(|a| *a > 1e-3).collect();
            areas.sort_by(f64::total_cmp);
            assert!(areas.len() == 3 && areas[2] < 50.0, "{gap}: {areas:?}");
        }
    }

    #[test]
    fn a_polygon_with_holes_is_its_triangles() {
        let v = DVec2::new;
        let square = |x: f64, r: f64| vec![v(x - r, -r), v(x + r, -r), v(x + r, r), v(x - r, r)];
        // A ring within which the two holes overlap.
        let contours = vec![square(0.0, 5.0), square(-1.0, 2.0), square(1.0, 2.0)];
        let odd = enclosed(&contours, false);
        let sum = |shapes: &[Polygon]| -> f64 {
            let all = shapes.iter().flat_map(triangles);
            all.map(|t| (t[1] - t[0]).perp_dot(t[2] - t[0]).abs() * 0.5).sum()
        };
        assert!((sum(&odd) - (100.0 - 24.0 + 8.0)).abs() < 1e-9);
        assert!((sum(&odd) - odd.iter().map(area).sum::<f64>()).abs() < 1e-9);
        let wound = enclosed(&contours, true);
        assert!((sum(&wound) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn merging_takes_inner_lines_away() {
        let v = DVec2::new;
        let square = |x: f64| vec![vec![v(x, 0.), v(x + 1., 0.), v(x + 1., 1.), v(x, 1.)]];
        let merged = merged(&[square(0.0), square(1.0)]);
        assert_eq!((merged.len(), merged[0].len(), merged[0][0].len()), (1, 1, 4));
        assert!((area(&merged[0]) - 2.0).abs() < 1e-12);
        let inside = points_inside(&merged[0])[0];
        assert!(inside.x > 0.1 && inside.x < 1.9 && inside.y > 0.1 && inside.y < 0.9);
    }
}
