//! The numbers after a PLY header, one after another, whichever way they are written.

use super::header::{Element, Kind};
use crate::text;

/// Numbers in file order. `None` is the end of the file, or something that is no number.
pub(super) trait Numbers {
    /// The next number. Every kind fits.
    fn next(&mut self, kind: Kind) -> Option<f64>;

    /// Passes over `count` numbers.
    fn skip(&mut self, kind: Kind, count: u64) -> Option<()>;

    /// The most numbers of this kind that can follow.
    fn most(&self, kind: Kind) -> u64;

    /// Whether so many rows can follow at all, given the bytes that are left.
    fn can_hold(&self, element: &Element) -> bool;
}

/// Numbers as words between blanks.
pub(super) struct Words<'a>(pub(super) &'a [u8]);

impl Words<'_> {
    fn word(&mut self) -> Option<&[u8]> {
        let rest = self.0.trim_ascii_start();
        let end = rest.iter().position(|&b| text::is_blank(b)).unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.0 = rest;
        (!word.is_empty()).then_some(word)
    }
}

impl Numbers for Words<'_> {
    #[inline]
    fn next(&mut self, kind: Kind) -> Option<f64> {
        let word = self.word()?;
        if kind.is_float() {
            return text::number(word).map(f64::from);
        }
        let word = std::str::from_utf8(word).ok()?;
        // Some software writes whole numbers with a point all the same.
        word.parse::<i64>().map(|n| n as f64).ok().or_else(|| word.parse().ok())
    }

    fn skip(&mut self, _: Kind, count: u64) -> Option<()> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    fn most(&self, _: Kind) -> u64 {
        // A digit and a blank each, no blank after the last.
        (self.0.len() as u64).div_ceil(2)
    }

    fn can_hold(&self, element: &Element) -> bool {
        element.count.checked_mul(element.properties.len() as u64).is_some_and(|n| n <= self.most(Kind::U8))
    }
}

/// Binary numbers; `BIG` says that the highest byte comes first.
pub(super) struct Binary<'a, const BIG: bool>(pub(super) &'a [u8]);

impl<const BIG: bool> Binary<'_, BIG> {
    #[inline]
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        let mut bytes = *bytes;
        if BIG {
            bytes.reverse();
        }
        Some(bytes)
    }
}

impl<const BIG: bool> Numbers for Binary<'_, BIG> {
    #[inline]
    fn next(&mut self, kind: Kind) -> Option<f64> {
        Some(match kind {
            Kind::I8 => i8::from_le_bytes(self.bytes()?).into(),
            Kind::U8 => u8::from_le_bytes(self.bytes()?).into(),
            Kind::I16 => i16::from_le_bytes(self.bytes()?).into(),
            Kind::U16 => u16::from_le_bytes(self.bytes()?).into(),
            Kind::I32 => i32::from_le_bytes(self.bytes()?).into(),
            Kind::U32 => u32::from_le_bytes(self.bytes()?).into(),
            Kind::F32 => f32::from_le_bytes(self.bytes()?).into(),
            Kind::F64 => f64::from_le_bytes(self.bytes()?),
        })
    }

    fn skip(&mut self, kind: Kind, count: u64) -> Option<()> {
        let length = usize::try_from(count.checked_mul(kind.size() as u64)?).ok()?;
        self.0 = self.0.get(length..)?;
        Some(())
    }

    fn most(&self, kind: Kind) -> u64 {
        (self.0.len() / kind.size()) as u64
    }

    fn can_hold(&self, element: &Element) -> bool {
        let row: u64 = element.properties.iter().map(|p| p.list.unwrap_or(p.kind).size() as u64).sum();
        element.count.checked_mul(row).is_some_and(|n| n <= self.0.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ply::header::Property;

    #[test]
    fn words_and_bytes_give_the_same_numbers() {
        let mut words = Words(b" -1\t255\r\n1.5 2.0 x");
        assert_eq!(words.next(Kind::I8), Some(-1.0));
        assert_eq!(words.next(Kind::U8), Some(255.0));
        assert_eq!(words.next(Kind::F32), Some(1.5));
        assert_eq!(words.next(Kind::I32), Some(2.0));
        assert_eq!((words.next(Kind::I32), words.next(Kind::I32)), (None, None));
        let mut big = Binary::<true>(&[0xff, 0x01, 0x02, 0xff, 0xff, 0xff, 0xfe, 9]);
        assert_eq!(big.next(Kind::U8), Some(255.0));
        assert_eq!(big.next(Kind::I16), Some(258.0));
        assert_eq!(big.next(Kind::I32), Some(-2.0));
        assert_eq!((big.next(Kind::F64), big.most(Kind::U16), big.skip(Kind::U8, 2)), (None, 0, None));
        let mut little = Binary::<false>(&[0x02, 0x01]);
        assert_eq!(little.next(Kind::U16), Some(258.0));
    }

    #[test]
    fn counts_that_overflow_are_not_held() {
        let property = |list| Property { name: "x".into(), kind: Kind::F64, list };
        let with = |count, properties| Element { name: "e".into(), count, properties };
        let huge = with(u64::MAX / 4, vec![property(None); 9]);
        assert!(!Words(b"1 2").can_hold(&huge) && !Binary::<true>(b"12").can_hold(&huge));
        let lists = with(2, vec![property(Some(Kind::U8))]);
        assert!(Words(b"0 0").can_hold(&lists) && !Words(b"0").can_hold(&lists));
        assert!(Binary::<true>(b"00").can_hold(&lists) && !Binary::<true>(b"0").can_hold(&lists));
        assert!(Words(b"").can_hold(&with(u64::MAX, vec![])), "rows of nothing");
    }
}
