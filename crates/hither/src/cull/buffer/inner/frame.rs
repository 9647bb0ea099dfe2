//! Which way the boxes lie: along the faces that have most area.
//!
//! Frames are made of the directions in which most area faces, two at right angles each, and the one in which
//! Σ area·(nx⁴ + ny⁴ + nz⁴) is largest wins: 1 a unit of area along an axis, ⅓ at worst. Nothing depends on the
//! choice but how large boxes become.

use glam::DVec3;

/// Bins along each side of the three faces of a cube that directions are sorted into.
const BINS: usize = 24;
/// So many of the directions with most area are tried.
const DIRECTIONS: usize = 6;
/// Directions are at right angles if their cosine is below this.
const SQUARE: f64 = 0.02;
/// A turned frame must be better than the given axes by this factor.
const BETTER: f64 = 1.02;

/// A direction, either sense, and the area that faces it.
#[derive(Clone, Copy, Default)]
struct Facing {
    /// Of the largest triangle.
    normal: DVec3,
    largest: f64,
    area: f64,
}

/// Three axes, right-handed and at right angles to within rounding, for triangles near `center` of `extent`.
pub(super) fn chosen(triangles: &[[DVec3; 3]], center: DVec3, extent: f64) -> [DVec3; 3] {
    let mut facing = facings(triangles, center, extent);
    facing.sort_by(|a, b| b.area.total_cmp(&a.area));
    let main: Vec<DVec3> = facing.iter().take(DIRECTIONS).map(|f| f.normal).collect();
    let score = |axes: &[DVec3; 3]| -> f64 {
        let alike = |n: DVec3| axes.iter().map(|a| a.dot(n).powi(4)).sum::<f64>();
        facing.iter().map(|f| f.area * alike(f.normal)).sum()
    };
    let mut best = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut best_score = score(&best) * BETTER;
    for (i, &a) in main.iter().enumerate() {
        let square = main.iter().enumerate().filter(|&(_, b)| a.dot(*b).abs() < SQUARE);
        let any = main.iter().enumerate().filter(|&(j, _)| j != i);
        let mut others: Vec<DVec3> = square.filter(|&(j, _)| j > i).map(|(_, &b)| b).collect();
        if others.is_empty() {
            others.extend(any.map(|(_, &b)| b).take(1));
        }
        for b in others {
            let Some(axes) = right_angled(a, b) else { continue };
            let s = score(&axes);
            if s > best_score {
                (best, best_score) = (axes, s);
            }
        }
    }
    best
}

/// `a`, what of `b` is at right angles to it, and what is to both.
fn right_angled(a: DVec3, b: DVec3) -> Option<[DVec3; 3]> {
    let b = (b - a * a.dot(b)).try_normalize()?;
    // Once more: the first time loses digits where the two are nearly parallel.
    let b = (b - a * a.dot(b)).try_normalize()?;
    let c = a.cross(b).try_normalize()?;
    Some([a, b, c])
}

fn facings(triangles: &[[DVec3; 3]], center: DVec3, extent: f64) -> Vec<Facing> {
    let mut bins = vec![Facing::default(); 3 * BINS * BINS];
    for &[a, b, c] in triangles {
        // Near 1, so that products neither overflow nor vanish.
        let [a, b, c] = [a, b, c].map(|p| (p - center) / extent);
        let doubled = (b - a).cross(c - a);
        let area = doubled.length();
        let Some(normal) = doubled.try_normalize() else { continue };
        let size = normal.abs();
        let axis = usize::from(size.y > size.x.max(size.z)) + 2 * usize::from(size.z > size.x.max(size.y));
        let side =
            |u: f64| ((u / normal[axis] * 0.5 + 0.5) * BINS as f64).clamp(0.0, BINS as f64 - 1.0) as usize;
        let (u, v) = (side(normal[(axis + 1) % 3]), side(normal[(axis + 2) % 3]));
        let bin = &mut bins[(axis * BINS + u) * BINS + v];
        bin.area += area;
        if area > bin.largest {
            (bin.largest, bin.normal) = (area, normal);
        }
    }
    bins.retain(|b| b.area > 0.0);
    bins
}
