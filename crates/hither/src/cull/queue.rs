//! What is open on a walk, the nearest first. Exactly: it holds thousands, where the renderer's queue holds hundreds of
//! thousands and is content with about the nearest.

use std::collections::BinaryHeap;

/// A queue of values with depths (larger is nearer); of what is equally near, what was pushed first comes first. It
/// holds all that was pushed until it is cleared.
#[derive(Clone, Debug)]
pub(super) struct NearestFirst<T> {
    /// The bits of a depth above the complement of a place in `pushed`: small, as they are moved about a lot.
    order: BinaryHeap<u64>,
    pushed: Vec<T>,
}

impl<T: Copy> NearestFirst<T> {
    pub fn new() -> NearestFirst<T> {
        NearestFirst { order: BinaryHeap::new(), pushed: Vec::new() }
    }

    pub fn clear(&mut self) {
        self.order.clear();
        self.pushed.clear();
    }

    /// Adds `value` at `depth`, which is not negative and not NaN.
    #[inline(always)]
    pub fn push(&mut self, value: T, depth: f32) {
        // Depths that are 0 or more are ordered as their bits are.
        self.order.push(u64::from(depth.to_bits()) << 32 | u64::from(!(self.pushed.len() as u32)));
        self.pushed.push(value);
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<T> {
        let place = !(self.order.pop()? as u32);
        Some(self.pushed[place as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_comes_first_and_among_equals_what_was_pushed_first() {
        let mut queue = NearestFirst::new();
        for round in 0..2 {
            let depths = [0.5, 0.0, f32::INFINITY, 0.5, 1e-30, 1.0, 0.5];
            depths.iter().enumerate().for_each(|(k, depth)| queue.push((round, k), *depth));
            let popped: Vec<_> = std::iter::from_fn(|| queue.pop()).collect();
            assert_eq!(popped, [2, 5, 0, 3, 6, 4, 1].map(|k| (round, k)));
            queue.clear();
        }
    }
}
