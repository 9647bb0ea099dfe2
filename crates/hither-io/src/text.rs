//! Lines, words and numbers of text formats, taken from bytes as they come: no encoding is assumed.

use memchr::{memchr, memchr2, memrchr};
use std::borrow::Cow;

/// Lines of a text, ended by LF, CR or both; the last needs no end.
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    number: u64,
    continues: bool,
    joined: Vec<u8>,
}

/// `bytes` without the mark of UTF-8 that may stand at the beginning of a file.
pub(crate) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// `bytes` in `count` pieces of about the same length, each of whole lines that [`Lines::continued`] does not join
/// with those of the next.
pub(crate) fn pieces(bytes: &[u8], count: usize) -> Vec<&[u8]> {
    let mut rest = bytes;
    let mut pieces = Vec::new();
    for left in (2..=count).rev() {
        let piece;
        (piece, rest) = rest.split_at(end_of_joined_lines(rest, rest.len() / left));
        pieces.push(piece);
    }
    pieces.push(rest);
    pieces
}

/// The end of the first line that ends at `from` or later and goes on in no other.
fn end_of_joined_lines(bytes: &[u8], from: usize) -> usize {
    let mut from = from;
    while let Some(length) = memchr(b'\n', &bytes[from..]) {
        let end = from + length;
        let start = memrchr(b'\n', &bytes[..end]).map_or(0, |before| before + 1);
        if bytes[start..end].trim_ascii_end().last() != Some(&b'\\') {
            return end + 1;
        }
        from = end + 1;
    }
    bytes.len()
}

impl<'a> Lines<'a> {
    /// The lines of `bytes`.
    pub(crate) fn plain(bytes: &'a [u8]) -> Lines<'a> {
        Lines { rest: bytes, number: 0, continues: false, joined: Vec::new() }
    }

    /// As [`Lines::plain`], but a line whose last byte is `\` goes on in the next one, unless it is a comment
    /// (begins with `#`), where a path may well end so.
    pub(crate) fn continued(bytes: &'a [u8]) -> Lines<'a> {
        Lines { continues: true, ..Lines::plain(bytes) }
    }

    /// Number of the last physical line that was taken, from 1.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// The next line without its end and without blanks at either side.
    #[inline]
    pub(crate) fn next(&mut self) -> Option<&[u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let line = self.physical().trim_ascii();
        if !self.continues || line.last() != Some(&b'\\') || line.first() == Some(&b'#') {
            return Some(line);
        }
        Some(self.join(line))
    }

    fn physical(&mut self) -> &'a [u8] {
        self.number += 1;
        let Some(end) = memchr2(b'\n', b'\r', self.rest) else {
            return std::mem::take(&mut self.rest);
        };
        let (line, rest) = self.rest.split_at(end);
        self.rest = if rest.starts_with(b"\r\n") { &rest[2..] } else { &rest[1..] };
        line
    }

    #[cold]
    fn join(&mut self, first: &'a [u8]) -> &[u8] {
        self.joined.clear();
        let mut line = first;
        loop {
            let Some(body) = line.strip_suffix(b"\\") else {
                self.joined.extend_from_slice(line);
                break;
            };
            self.joined.extend_from_slice(body);
            self.joined.push(b' ');
            if self.rest.is_empty() {
                break;
            }
            line = self.physical().trim_ascii();
        }
        self.joined.trim_ascii()
    }
}

/// Takes the next word, up to a blank, from the front of `line`; `None` at its end or at a `#`.
#[inline]
pub(crate) fn word<'a>(line: &mut &'a [u8]) -> Option<&'a [u8]> {
    let start = line.iter().position(|&b| !is_blank(b)).unwrap_or(line.len());
    let rest = &line[start..];
    if rest.first().is_none_or(|&b| b == b'#') {
        *line = &[];
        return None;
    }
    let end = rest.iter().position(|&b| is_blank(b)).unwrap_or(rest.len());
    let (word, rest) = rest.split_at(end);
    *line = rest;
    Some(word)
}

/// Whether `byte` parts words.
#[inline]
pub(crate) fn is_blank(byte: u8) -> bool {
    byte <= b' '
}

/// The number that `word` is, rounded to the nearest; a word that is none gives `None`. "nan" and "inf"
/// are numbers here, and so may be the answer to too large an exponent.
#[inline]
pub(crate) fn number(word: &[u8]) -> Option<f32> {
    plain_number(word).or_else(|| std::str::from_utf8(word).ok()?.parse().ok())
}

/// As [`number`], for the digits with a point that files mostly hold: three times as fast as `str::parse`.
#[inline]
fn plain_number(word: &[u8]) -> Option<f32> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    // At most 18 bytes, so the digits do not overflow.
    if digits.len() > 18 {
        return None;
    }
    let (mut mantissa, mut point) = (0u64, digits.len());
    for (i, &byte) in digits.iter().enumerate() {
        let digit = byte.wrapping_sub(b'0');
        if digit <= 9 {
            mantissa = mantissa * 10 + u64::from(digit);
        } else if byte == b'.' && point == digits.len() {
            point = i;
        } else {
            return None;
        }
    }
    let has_point = usize::from(point < digits.len());
    if digits.len() == has_point || mantissa >= 1 << 53 {
        return None;
    }
    let decimals = digits.len() - point - has_point;
    // Both are exact, so the quotient is the nearest `f64`. Rounding it once more is wrong only if it lies
    // exactly between two `f32`s, which the true value need not; below 1e-30 `f32`s begin to thin out.
    let value = mantissa as f64 / POWERS_OF_TEN[decimals];
    let is_between = value.to_bits() & 0x1fff_ffff == 0x1000_0000;
    if is_between || (value < 1e-30 && mantissa != 0) {
        return None;
    }
    let value = value as f32;
    Some(if negative { -value } else { value })
}

const POWERS_OF_TEN: [f64; 19] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18];

/// `text` on one line that does nothing to a terminal but appear there: characters that control it, or the direction
/// of writing, are escaped. For messages, which may hold names out of files.
pub fn one_line(text: &str) -> Cow<'_, str> {
    let acts = |c: char| {
        c.is_control()
            || matches!(c, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut line = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if acts(c) { line.extend(c.escape_debug()) } else { line.push(c) }
    }
    Cow::Owned(line)
}

/// `text` in quotes, on one line and not long, whatever it holds.
pub(crate) fn quoted(text: &[u8]) -> String {
    const LONGEST: usize = 80;
    // Four bytes make a character at most, so this is enough of them and never much.
    let start = &text[..text.len().min(4 * LONGEST + 4)];
    let start = String::from_utf8_lossy(start);
    let mut quoted = String::from("\"");
    quoted.extend(start.chars().take(LONGEST).flat_map(char::escape_debug));
    if start.chars().nth(LONGEST).is_some() {
        quoted.push('…');
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lines(text: &str) -> Vec<(u64, String)> {
        let mut lines = Lines::continued(text.as_bytes());
        let mut all = Vec::new();
        while let Some(line) = lines.next() {
            let line = String::from_utf8_lossy(line).into_owned();
            all.push((lines.number(), line));
        }
        all
    }

    #[test]
    fn every_line_end_ends_a_line_and_is_counted_once() {
        let expected: Vec<(u64, String)> = vec![(1, "a".into()), (2, "".into()), (3, "b c".into())];
        for text in ["a\n\nb c", "a\r\n\r\nb c\r\n", "a\r\rb c\r", " a \n\t\nb c  \n"] {
            assert_eq!(lines(text), expected, "{text:?}");
        }
    }

    #[test]
    fn a_backslash_joins_lines_but_not_in_comments() {
        let joined = lines("f 1 \\\n 2\\\r\n3\n# C:\\\nv\n\\\nx\\");
        let text: Vec<&str> = joined.iter().map(|(_, line)| line.as_str()).collect();
        assert_eq!(text, ["f 1  2 3", "# C:\\", "v", "x"]);
        assert_eq!(joined[0].0, 3);
        assert_eq!(lines("\\"), [(1, String::new())]);
        assert_eq!(Lines::plain(b"a\\\nb").next(), Some(&b"a\\"[..]));
    }

    #[test]
    fn words_end_at_blanks_and_comments() {
        let mut line = &b" \tab  c # d"[..];
        assert_eq!(word(&mut line), Some(&b"ab"[..]));
        assert_eq!(word(&mut line), Some(&b"c"[..]));
        assert_eq!(word(&mut line), None);
        assert_eq!(word(&mut line), None);
    }

    #[test]
    fn numbers_are_numbers() {
        for (word, value) in [("1", 1.0), ("-.5", -0.5), ("+2.", 2.0), ("1e-3", 1e-3), ("0.1", 0.1f32)] {
            assert_eq!(number(word.as_bytes()), Some(value));
        }
        assert!(number(b"nan").unwrap().is_nan() && number(b"1e99").unwrap().is_infinite());
        for word in ["", "x", "1,5", "1.0f", "0x1", "--1", "1.#QNAN"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
    }

    proptest! {
        #[test]
        fn plain_numbers_are_rounded_as_the_standard_library_does(
            text in "-?[0-9]{0,12}\\.?[0-9]{0,12}",
            bits in any::<u32>(),
            digits in 0usize..12,
        ) {
            // Numbers as programs print them, and halfway between two of them.
            let float = f32::from_bits(bits);
            let between = (f64::from(float) + f64::from(float.next_up())) / 2.0;
            for text in [text, format!("{float:.digits$}"), format!("{between:.digits$}"), format!("{between}")] {
                let exact = text.parse::<f32>().ok();
                prop_assert_eq!(number(text.as_bytes()).map(f32::to_bits), exact.map(f32::to_bits), "{}", text);
            }
        }
    }

    #[test]
    fn a_line_stays_one_line_and_acts_on_no_terminal() {
        assert_eq!(one_line("a\nb\u{1b}[31m\u{9b}c\r\u{202e}d"), "a\\nb\\u{1b}[31m\\u{9b}c\\r\\u{202e}d");
        assert!(matches!(one_line("C:\\ünï \"x\""), Cow::Borrowed("C:\\ünï \"x\"")));
    }

    #[test]
    fn quotes_are_short_and_plain() {
        assert_eq!(quoted(b"a\nb\xff"), "\"a\\nb\u{fffd}\"");
        assert!(quoted(&[b'x'; 1000]).chars().count() < 90);
    }
}
