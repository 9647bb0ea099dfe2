//! The colours of DXF: 255 numbers, the same in every program, but for a few greys.

/// The number of the colour that is nearest to an sRGB colour.
pub(super) fn nearest(color: [u8; 3]) -> u8 {
    let distance = |number: u8| -> i32 {
        let of = srgb(number);
        // The eye tells greens apart best.
        let weights = [2, 4, 3];
        (0..3).map(|k| weights[k] * (i32::from(of[k]) - i32::from(color[k])).pow(2)).sum()
    };
    // 1 to 9 are among the others, or, as white, drawn black on white paper.
    (10..=255).min_by_key(|&number| distance(number)).unwrap_or(255)
}

/// A colour from 10 on: 24 hues, five of lightness, each full and half saturated; then six greys.
fn srgb(number: u8) -> [u8; 3] {
    const GREYS: [u8; 6] = [51, 91, 132, 173, 214, 255];
    const LIGHTNESS: [u32; 5] = [255, 165, 127, 76, 38];
    if number >= 250 {
        return [GREYS[usize::from(number - 250)]; 3];
    }
    let (hue, rest) = (u32::from(number) / 10 - 1, number % 10);
    let lightness = LIGHTNESS[usize::from(rest / 2)];
    // Of each channel a quarter of the way up to full for each step of 15 degrees.
    let channel = |from_full: u32| {
        let steps = from_full.min(24 - from_full);
        let full = 4u32.saturating_sub(steps.saturating_sub(4));
        let value = lightness * full / 4;
        (if rest % 2 == 1 { (value + lightness) / 2 } else { value }) as u8
    };
    [channel(hue), channel((hue + 16) % 24), channel((hue + 8) % 24)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_palette_is_as_cad_programs_have_it() {
        let known = [
            (10, [255, 0, 0]),
            (11, [255, 127, 127]),
            (20, [255, 63, 0]),
            (50, [255, 255, 0]),
            (93, [82, 165, 82]),
            (130, [0, 255, 255]),
            (158, [0, 19, 38]),
            (170, [0, 0, 255]),
            (214, [127, 0, 127]),
            (255, [255, 255, 255]),
        ];
        for (number, color) in known {
            assert_eq!(srgb(number), color, "{number}");
            assert_eq!(nearest(color), number);
        }
        assert_eq!(nearest([128, 130, 131]), 252);
    }
}
