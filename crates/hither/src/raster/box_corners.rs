//! The eight corners of several boxes under a row of a matrix: a vector's worth at once, of any width.

use fearless_simd::{Simd, prelude::*};

/// The smallest or largest coordinates of boxes from lane `from` on, (axis, lane).
#[inline(always)]
pub(crate) fn axes<S: Simd, V: SimdFloat<S, Element = f32>>(
    simd: S,
    sides: &[[f32; 16]; 3],
    from: usize,
) -> [V; 3] {
    let to = from + V::LEN;
    [
        V::from_slice(simd, &sides[0][from..to]),
        V::from_slice(simd, &sides[1][from..to]),
        V::from_slice(simd, &sides[2][from..to]),
    ]
}

/// `row · corner` for the eight corners; bit 0 of the corner is x, bit 1 y, bit 2 z.
#[inline(always)]
pub(crate) fn corners<S: Simd, V: SimdFloat<S, Element = f32>>(
    row: &[f32; 4],
    lo: &[V; 3],
    hi: &[V; 3],
) -> [V; 8] {
    let (xy, z) = corner_sums(row, lo, hi);
    [
        xy[0] + z[0],
        xy[1] + z[0],
        xy[2] + z[0],
        xy[3] + z[0],
        xy[0] + z[1],
        xy[1] + z[1],
        xy[2] + z[1],
        xy[3] + z[1],
    ]
}

/// What [`corners`] adds up: the part of x and y, by the corner's lower two bits, and that of z, by its highest. A loop
/// over corners that adds them itself needs fewer registers.
#[inline(always)]
pub(crate) fn corner_sums<S: Simd, V: SimdFloat<S, Element = f32>>(
    row: &[f32; 4],
    lo: &[V; 3],
    hi: &[V; 3],
) -> ([V; 4], [V; 2]) {
    let x = [lo[0] * row[0] + row[3], hi[0] * row[0] + row[3]];
    let y = [lo[1] * row[1], hi[1] * row[1]];
    ([x[0] + y[0], x[1] + y[0], x[0] + y[1], x[1] + y[1]], [lo[2] * row[2], hi[2] * row[2]])
}

#[inline(always)]
pub(crate) fn smallest<S: Simd, V: SimdFloat<S>>(v: &[V; 8]) -> V {
    (v[0].min(v[1])).min(v[2].min(v[3])).min((v[4].min(v[5])).min(v[6].min(v[7])))
}

#[inline(always)]
pub(crate) fn largest<S: Simd, V: SimdFloat<S>>(v: &[V; 8]) -> V {
    (v[0].max(v[1])).max(v[2].max(v[3])).max((v[4].max(v[5])).max(v[6].max(v[7])))
}
