//! The sRGB transfer function (IEC 61966-2-1) between linear light and 8-bit codes, rounded correctly.

use std::sync::LazyLock;

/// Linear value, 0 to 1, of an sRGB-encoded value from 0 to 1; what lies outside is continued.
pub(crate) fn linear(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Turns linear values into the nearest of the 256 sRGB codes.
pub(crate) struct Encoder {
    /// `ends[c]` is the linear value halfway (in code space) between codes `c` and `c + 1`.
    ends: [f32; 255],
    /// The code at the lower end of each of [`BINS`] equal intervals of [0, 1].
    first: [u8; BINS],
}

/// Where codes are closest, a code spans 1.24 bins, so from a bin's first code it is one step at most.
const BINS: usize = 4096;

static ENCODER: LazyLock<Encoder> = LazyLock::new(Encoder::new);

impl Encoder {
    /// The one encoder.
    pub(crate) fn get() -> &'static Encoder {
        &ENCODER
    }

    fn new() -> Encoder {
        let ends = std::array::from_fn(|c| linear((c as f64 + 0.5) / 255.0) as f32);
        let first = std::array::from_fn(|bin| {
            let low = bin as f32 / BINS as f32;
            ends.partition_point(|&end| end <= low) as u8
        });
        Encoder { ends, first }
    }

    /// The code of a linear value; below 0 and NaN give 0, above 1 gives 255.
    pub(crate) fn encode(&self, linear: f32) -> u8 {
        let x = linear.max(0.0);
        if x >= 1.0 {
            return 255;
        }
        let mut code = self.first[(x * BINS as f32) as usize];
        while code < 255 && x >= self.ends[usize::from(code)] {
            code += 1;
        }
        code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded(x: f32) -> u8 {
        let x = f64::from(x);
        let encoded = if x <= 0.003_130_8 { x * 12.92 } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
        (encoded * 255.0).round() as u8
    }

    #[test]
    fn every_code_survives_the_way_there_and_back() {
        for code in 0..=255u8 {
            assert_eq!(Encoder::get().encode(linear(f64::from(code) / 255.0) as f32), code);
        }
    }

    #[test]
    fn a_fine_sweep_is_rounded_to_the_nearest_code() {
        let steps = 1 << 20;
        for i in 0..=steps {
            let x = i as f32 / steps as f32;
            let exact = rounded(x);
            let code = Encoder::get().encode(x);
            // Only on the boundary itself may the two roundings differ.
            let on_boundary =
                Encoder::get().ends.iter().any(|&end| (end - x).abs() <= f32::EPSILON * end.max(0.01));
            assert!(code == exact || on_boundary, "{x}: {code} for {exact}");
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped() {
        let encode = |x| Encoder::get().encode(x);
        assert_eq!([encode(-1.0), encode(f32::NAN), encode(f32::NEG_INFINITY)], [0; 3]);
        assert_eq!([encode(1.0), encode(7.0), encode(f32::INFINITY)], [255; 3]);
        assert_eq!(encode(1.0f32.next_down()), 255);
    }
}
