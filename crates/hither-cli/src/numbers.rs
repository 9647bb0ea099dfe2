//! Numbers and vectors as people read them.

use glam::DVec3;

/// `n` with a comma at each thousand.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// `x` with four significant digits; very large and very small numbers in scientific notation.
pub fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{}", x + 0.0);
    }
    let exponent = x.abs().log10().floor() as i32;
    if !(-4..9).contains(&exponent) {
        return format!("{x:.3e}");
    }
    let decimals = (3 - exponent).clamp(0, 9) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

/// Three numbers, short. What is nothing beside the largest is 0.
pub fn point(p: DVec3) -> String {
    let least = p.abs().max_element() * 1e-9;
    let [x, y, z] = p.to_array().map(|c| short(if c.abs() < least { 0.0 } else { c }));
    format!("{x},{y},{z}")
}

/// `n thing`, with an `s` unless `n` is 1.
pub fn count(n: u64, thing: &str) -> String {
    format!("{} {thing}{}", grouped(n), if n == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_grouped() {
        let texts: Vec<String> = [0, 999, 1000, 539_055_000].map(grouped).into();
        assert_eq!(texts, ["0", "999", "1,000", "539,055,000"]);
    }

    #[test]
    fn short_keeps_four_digits_and_no_tail_of_zeros() {
        let texts: Vec<String> = [0.0, -0.0, 1.0, 0.25, 12.3456, 123_456.7, -2e18, 1e-18].map(short).into();
        assert_eq!(texts, ["0", "0", "1", "0.25", "12.35", "123457", "-2.000e18", "1.000e-18"]);
        assert_eq!(point(DVec3::new(5e-17, -6.5, 2e-3)), "0,-6.5,0.002");
    }
}
