//! Clipping to the near plane and the guard band, in f64, for the few triangles that need it. The depth plane is
//! the whole triangle's, not the pieces'.

use super::Rect;
use super::guard::{GUARD_MAX, GUARD_MIN, GuardedPolygon};
use super::setup::{MAX_SLOPE, ScreenTriangle};
use super::transform::ScreenFromObject;

/// The visible part of a clipped triangle, as a fan of at most six.
pub(super) struct Pieces {
    fan: [Option<ScreenTriangle>; 6],
    /// Whether the triangle faces the eye, or may be seen from behind.
    pub faces_eye: bool,
}

impl Pieces {
    const NONE: Pieces = Pieces { fan: [None; 6], faces_eye: false };

    pub fn triangles(&self) -> impl Iterator<Item = &ScreenTriangle> {
        self.fan.iter().flatten()
    }
}

pub(super) fn clip(corners: &[[f32; 3]; 3], at: &ScreenFromObject, two_sided: bool, window: Rect) -> Pieces {
    let v = corners.map(|c| at.point(c.map(f64::from)));
    if v.iter().flatten().any(|c| !c.is_finite()) {
        return Pieces::NONE;
    }
    // Facing without projecting: the sign of the eye's side of the triangle's plane.
    let volume =
        determinant([v[0][0], v[1][0], v[2][0]], [v[0][1], v[1][1], v[2][1]], [v[0][2], v[1][2], v[2][2]]);
    let front = volume * at.front_sign > 0.0;
    if volume == 0.0 || !(front || two_sided) {
        return Pieces::NONE;
    }
    match GuardedPolygon::of_triangle(&v, [(); 3], ()) {
        Some(polygon) => fan(&polygon, &v, volume > 0.0, window),
        None => Pieces { faces_eye: true, ..Pieces::NONE },
    }
}

fn fan(polygon: &GuardedPolygon<()>, v: &[[f64; 4]; 3], positive: bool, window: Rect) -> Pieces {
    let plane = homogeneous_plane(v);
    let mut screen = [([0i32; 2], 0f32); 8];
    for (s, (p, ())) in screen.iter_mut().zip(&polygon.corner[..polygon.len]) {
        // Cut points may miss the band by a rounding; snapping must not.
        let snap = |c: f64| (c / p[2]).clamp(GUARD_MIN * 256.0, GUARD_MAX * 256.0).round_ties_even() as i32;
        *s = ([snap(p[0]), snap(p[1])], (p[3] / p[2]).clamp(0.0, 1.0) as f32);
    }
    let depths = || screen[..polygon.len].iter().map(|s| s.1);
    let depth_min = depths().fold(f32::INFINITY, f32::min);
    let depth_max = depths().fold(0.0, f32::max);
    let mut pieces = Pieces { faces_eye: true, ..Pieces::NONE };
    for i in 1..polygon.len - 1 {
        let corners = [screen[0].0, screen[i].0, screen[i + 1].0];
        if let Some((x, y, bounds)) = bounded(corners, positive, window) {
            pieces.fan[i - 1] = Some(ScreenTriangle { x, y, bounds, plane, depth_min, depth_max });
        }
    }
    pieces
}

/// The columns and the rows of a triangle's snapped corners, exchanged where its area is not to be `positive`; and the
/// pixels of the window whose centres its bounding box holds. `None` where either is empty.
pub(super) fn bounded(
    [a, mut b, mut c]: [[i32; 2]; 3],
    positive: bool,
    window: Rect,
) -> Option<([i32; 3], [i32; 3], Rect)> {
    if !positive {
        std::mem::swap(&mut b, &mut c);
    }
    let (x, y) = ([a[0], b[0], c[0]], [a[1], b[1], c[1]]);
    let first = |v: [i32; 3], low: i32| ((v[0].min(v[1]).min(v[2]) + 127) >> 8).max(low);
    let last = |v: [i32; 3], high: i32| (((v[0].max(v[1]).max(v[2]) - 128) >> 8) + 1).min(high);
    let bounds = Rect {
        left: first(x, window.left),
        top: first(y, window.top),
        right: last(x, window.right),
        bottom: last(y, window.bottom),
    };
    let some = doubled_area([a, b, c]) > 0 && bounds.left < bounds.right && bounds.top < bounds.bottom;
    some.then_some((x, y, bounds))
}

/// Twice the area of a triangle, 1/65536 pixel; positive if its corners run clockwise on the screen.
pub(super) fn doubled_area([a, b, c]: [[i32; 2]; 3]) -> i64 {
    i64::from(b[0] - a[0]) * i64::from(c[1] - a[1]) - i64::from(c[0] - a[0]) * i64::from(b[1] - a[1])
}

/// Depth over image pixel centres from D = α·X + β·Y + γ·W, which holds on the whole plane of the triangle.
fn homogeneous_plane(v: &[[f64; 4]; 3]) -> [f64; 3] {
    let column = |k: usize| [v[0][k], v[1][k], v[2][k]];
    let (x, y, w, d) = (column(0), column(1), column(2), column(3));
    let whole = determinant(x, y, w);
    let sane = |slope: f64| if slope.abs() <= MAX_SLOPE { slope } else { 0.0 };
    let alpha = sane(determinant(d, y, w) / whole * 256.0);
    let beta = sane(determinant(x, d, w) / whole * 256.0);
    let gamma = sane(determinant(x, y, d) / whole);
    [alpha, beta, gamma + (alpha + beta) * 0.5]
}

fn determinant(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
        + c[0] * (a[1] * b[2] - a[2] * b[1])
}
