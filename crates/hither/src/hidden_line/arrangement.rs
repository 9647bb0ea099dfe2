//! Polygons with holes: cut out of the plane, put together, filled, taken apart into triangles, looked into.
//!
//! The work is `i_overlay`'s: coordinates go to a grid of 62-bit integers, crossings are snapped to it, and every
//! predicate is exact.

use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::float::simplify::SimplifyShape;
use i_overlay::float::slice::FloatSlice;
use i_triangle::float::triangulatable::Triangulatable;

/// A polygon: its outline, then its holes. Closed, without repeating the first point.
pub(super) type Polygon = Vec<Vec<DVec2>>;

/// The polygons into which lines cut the rectangle from `min` to `max`. Lines that stick out cut nothing.
pub(super) fn sliced([min, max]: [DVec2; 2], lines: &[[DVec2; 2]]) -> Vec<Polygon> {
    let outline = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)];
    if lines.is_empty() {
        return vec![vec![outline.to_vec()]];
    }
    let outline: Vec<[f64; 2]> = outline.iter().map(|p| p.to_array()).collect();
    let paths: Vec<Vec<[f64; 2]>> = lines.iter().map(|l| l.map(|p| p.to_array()).to_vec()).collect();
    polygons(outline.slice_by_as::<i64>(&paths, FillRule::EvenOdd))
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

/// Points well inside polygons, first the middle of the widest stretch on some horizontal lines through each, last what
/// is nearer to the ends of stretches. None if they are too thin to have one.
pub(super) fn points_inside(polygons: &[Polygon]) -> Vec<DVec2> {
    /// Horizontal lines that are tried.
    const LINES: usize = 7;
    let mut found: Vec<(f64, [DVec2; 3])> = Vec::new();
    for polygon in polygons {
        let mut heights: Vec<f64> = polygon.iter().flatten().map(|p| p.y).collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let mut bands: Vec<[f64; 2]> = heights.windows(2).map(|w| [w[0], w[1]]).collect();
        bands.sort_by(|a, b| (b[1] - b[0]).total_cmp(&(a[1] - a[0])));
        for [low, high] in bands.into_iter().take(LINES) {
            let y = 0.5 * (low + high);
            for [from, to] in stretches(polygon, y) {
                let room = (to - from).min(high - low);
                if room > 0.0 {
                    found.push((room, [0.5, 0.1, 0.9].map(|t| DVec2::new(from + (to - from) * t, y))));
                }
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let place = |k: usize| found.iter().map(move |(_, points)| points[k]);
    place(0).chain(place(1)).chain(place(2)).collect()
}

/// The area of a polygon: of its outline less its holes.
pub(super) fn area(polygon: &Polygon) -> f64 {
    let mut areas = polygon.iter().map(|contour| area_within(contour));
    areas.next().map_or(0.0, |outline| outline - areas.sum::<f64>())
}

/// The area within a contour.
pub(super) fn area_within(contour: &[DVec2]) -> f64 {
    let n = contour.len();
    (0..n).map(|i| contour[i].perp_dot(contour[(i + 1) % n])).sum::<f64>().abs() * 0.5
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
        let inside = points_inside(&merged)[0];
        assert!(inside.x > 0.1 && inside.x < 1.9 && inside.y > 0.1 && inside.y < 0.9);
    }
}
