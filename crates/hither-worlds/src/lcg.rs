//! The linear congruential generator of the benchmark worlds, bit for bit.

/// A sequence of numbers that depends on the seed alone.
pub(crate) struct Lcg(u32);

impl Lcg {
    pub(crate) fn new(seed: u32) -> Lcg {
        Lcg(seed)
    }

    fn next_24_bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0 >> 8
    }

    /// A multiple of 2⁻²⁴ in [0, 1).
    pub(crate) fn unit(&mut self) -> f32 {
        self.next_24_bits() as f32 * (1.0 / 16_777_216.0)
    }

    /// A whole number below `n`.
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.next_24_bits()) * u64::from(n)) >> 24) as u32
    }

    /// A whole number below `n`, all of them in reach also where `n` exceeds 2²⁴.
    pub(crate) fn below_wide(&mut self, n: u32) -> u32 {
        let bits = u64::from(self.next_24_bits()) << 24 | u64::from(self.next_24_bits());
        ((u128::from(bits) * u128::from(n)) >> 48) as u32
    }
}
