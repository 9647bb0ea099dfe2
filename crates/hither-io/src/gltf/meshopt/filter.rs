//! What is undone after decoding: unit vectors, rotations, floats and colours packed with fewer bits.
//!
//! Values that the specification leaves undefined decode to something, never to a panic.

use super::{Damage, Filter};

/// Decodes all elements of `stride` bytes in place.
pub(super) fn apply(filter: Filter, elements: &mut [u8], stride: usize) -> Result<(), Damage> {
    match (filter, stride) {
        (Filter::Octahedral, 4) => each(elements, |v: [i8; 4]| octahedral(v.map(f32::from), 127.0, v[3])),
        (Filter::Octahedral, 8) => each(elements, |v: [i16; 4]| octahedral(v.map(f32::from), 32_767.0, v[3])),
        (Filter::Quaternion, 8) => each(elements, quaternion),
        (Filter::Exponential, _) => {
            for word in elements.as_chunks_mut::<4>().0 {
                *word = exponential(i32::from_le_bytes(*word)).to_le_bytes();
            }
        }
        (Filter::Color, 4) => each(elements, |v: [u8; 4]| {
            color([v[0].into(), (v[1] as i8).into(), (v[2] as i8).into(), v[3].into()], 255.0)
                .map(|c| c as u8)
        }),
        (Filter::Color, 8) => each(elements, |v: [u16; 4]| {
            color([v[0].into(), (v[1] as i16).into(), (v[2] as i16).into(), v[3].into()], 65_535.0)
                .map(|c| c as u16)
        }),
        _ => return Err("its stride does not suit its filter"),
    }
    Ok(())
}

/// A component as stored.
trait Stored: Copy + Default {
    const SIZE: usize;
    fn load(bytes: &[u8]) -> Self;
    fn store(self, bytes: &mut [u8]);
    fn from_float(value: f32) -> Self;
}

macro_rules! stored {
    ($($kind:ty),*) => {$(
        impl Stored for $kind {
            const SIZE: usize = size_of::<$kind>();
            fn load(bytes: &[u8]) -> Self {
                bytes.try_into().map_or(0, <$kind>::from_le_bytes)
            }
            fn store(self, bytes: &mut [u8]) {
                bytes.copy_from_slice(&self.to_le_bytes());
            }
            fn from_float(value: f32) -> Self {
                // Saturates, and turns NaN into 0.
                value.round() as $kind
            }
        }
    )*};
}

stored!(i8, u8, i16, u16);

fn each<T: Stored>(elements: &mut [u8], decode: impl Fn([T; 4]) -> [T; 4]) {
    for element in elements.chunks_exact_mut(4 * T::SIZE) {
        let mut value = [T::default(); 4];
        for (v, bytes) in value.iter_mut().zip(element.chunks_exact(T::SIZE)) {
            *v = T::load(bytes);
        }
        for (v, bytes) in decode(value).iter().zip(element.chunks_exact_mut(T::SIZE)) {
            v.store(bytes);
        }
    }
}

fn octahedral<T: Stored>(stored: [f32; 4], max: f32, fourth: T) -> [T; 4] {
    let (mut x, mut y) = (stored[0] / stored[2], stored[1] / stored[2]);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half of the octahedron is folded over the upper one.
    let fold = z.min(0.0);
    x -= fold.copysign(x);
    y -= fold.copysign(y);
    let scale = max / (x * x + y * y + z * z).sqrt();
    [T::from_float(x * scale), T::from_float(y * scale), T::from_float(z * scale), fourth]
}

fn quaternion(stored: [i16; 4]) -> [i16; 4] {
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(stored[3] | 3);
    let [x, y, z] = [stored[0], stored[1], stored[2]].map(|c| f32::from(c) * scale);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = usize::from(stored[3].cast_unsigned() & 3);
    let mut out = [0; 4];
    for (step, value) in [w, x, y, z].into_iter().enumerate() {
        out[(largest + step) % 4] = i16::from_float(value * 32_767.0);
    }
    out
}

fn exponential(stored: i32) -> f32 {
    let (exponent, mantissa) = (stored >> 24, (stored << 8) >> 8);
    // Exact in f64 for every exponent that eight bits hold; one rounding at the end.
    (f64::from(mantissa) * f64::from(exponent).exp2()) as f32
}

fn color(stored: [i32; 4], max: f32) -> [f32; 4] {
    let [y, co, cg, alpha] = stored;
    // The highest set bit of alpha tells how many bits the colour has.
    let bits = 32 - (alpha as u32).leading_zeros();
    let all = (1i32 << bits) - 1;
    let scale = max / (all.max(1) as f32);
    let a = alpha & (all >> 1);
    let a = (a << 1) | (a & 1);
    [y + co - cg, y + cg, y - co - cg, a].map(|c| (c as f32 * scale).round())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octahedral_normals_are_unit_in_both_halves() {
        for (stored, normal) in [
            ([0i16, 0, 1023, 7], [0.0, 0.0, 1.0]),
            ([1023, 0, 1023, 7], [1.0, 0.0, 0.0]),
            ([0, -1023, 1023, 7], [0.0, -1.0, 0.0]),
            ([1023, 1023, 1023, 7], [0.0, 0.0, -1.0]),
        ] {
            let mut bytes: Vec<u8> = stored.iter().flat_map(|v| v.to_le_bytes()).collect();
            apply(Filter::Octahedral, &mut bytes, 8).unwrap();
            let out: Vec<i16> = bytes.as_chunks().0.iter().map(|b| i16::from_le_bytes(*b)).collect();
            for k in 0..3 {
                assert!((f32::from(out[k]) / 32_767.0 - normal[k]).abs() < 1e-4, "{out:?}");
            }
            assert_eq!(out[3], 7);
        }
    }

    #[test]
    fn quaternions_find_their_largest_component() {
        // Identity: w is the largest, and is left out.
        assert_eq!(quaternion([0, 0, 0, 32_764 | 3]), [0, 0, 0, 32_767]);
        // A quarter turn about y: y and w are equal; the one left out is positive.
        let q = quaternion([0, 0, 32_767, 32_764 | 1]);
        assert!((q[1] - 23_170).abs() <= 1 && q[0] == 23_170 && q[2] == 0, "{q:?}");
    }

    #[test]
    fn floats_are_exact_at_the_ends_of_their_range() {
        assert_eq!(exponential(3), 3.0);
        assert_eq!(exponential((-2 << 24) | 5), 1.25);
        assert_eq!(exponential((100 << 24) | 1), 2f32.powi(100));
        assert_eq!(exponential(-1), -(2f32.powi(-1)));
        assert_eq!(exponential(i32::from_le_bytes([0, 0, 0, 0x9c])), 0.0);
    }

    #[test]
    fn colours_scale_with_their_bits() {
        // Eight bits: y 255, no chroma, alpha 127 with the marker bit.
        assert_eq!(color([255, 0, 0, 255], 255.0), [255.0; 4]);
        // Four bits, pure green: g = y + cg.
        assert_eq!(color([7, -1, 8, 15], 255.0), [-34.0, 255.0, 0.0, 255.0]);
    }

    #[test]
    fn undefined_values_do_not_panic() {
        for filter in [Filter::Octahedral, Filter::Quaternion, Filter::Exponential, Filter::Color] {
            for fill in [0u8, 0x7f, 0x80, 0xff] {
                let mut bytes = vec![fill; 64];
                apply(filter, &mut bytes, 8).unwrap();
            }
        }
        assert!(apply(Filter::Quaternion, &mut [0; 4], 4).is_err());
    }
}
