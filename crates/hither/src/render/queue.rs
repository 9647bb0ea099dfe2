//! A nearest-first queue in constant time: entries in buckets of about equal depth.
//!
//! A bucket spans 1/512 of an octave of depth (0.14 %); within one, the last in is the first out. What is
//! pushed while a walk goes on is never nearer than what it came from, so the front only moves away and
//! finding the next bucket costs one pass over the buckets a frame. Depth order across the whole scene,
//! not only within one tree, is what lets long, nested boxes be taken piece by piece.
//!
//! A queue that has run empty may start anew at any depth.

/// A queue of values with depths (larger is nearer).
#[derive(Debug)]
pub(super) struct NearestFirst<T> {
    /// First link of each bucket; `NONE` if empty.
    heads: Vec<u32>,
    links: Vec<(T, u32)>,
    free: u32,
    /// No bucket before this one holds anything.
    front: usize,
    len: usize,
}

const NONE: u32 = u32::MAX;
/// Depth's float bits without the sign, coarser than this many mantissa bits are ignored.
const FINE: u32 = 9;
const SHIFT: u32 = 23 - FINE;
/// Depths at or below 2⁻²⁴ share the last bucket; those above 1 the first.
const OCTAVES: u32 = 24;
const BUCKETS: usize = (OCTAVES << FINE) as usize + 2;

#[inline(always)]
fn bucket_of(depth: f32) -> usize {
    let one = 1.0f32.to_bits() >> SHIFT;
    let at = depth.to_bits() >> SHIFT;
    if at > one { 0 } else { ((one - at) as usize + 1).min(BUCKETS - 1) }
}

impl<T: Copy> NearestFirst<T> {
    pub fn new() -> NearestFirst<T> {
        NearestFirst {
            heads: vec![NONE; BUCKETS],
            links: Vec::with_capacity(1024),
            free: NONE,
            front: 0,
            len: 0,
        }
    }

    /// Adds `value` at `depth`, which is not negative and not NaN.
    #[inline(always)]
    pub fn push(&mut self, value: T, depth: f32) {
        let bucket = bucket_of(depth);
        let link = (value, self.heads[bucket]);
        let at = if self.free == NONE {
            self.links.push(link);
            (self.links.len() - 1) as u32
        } else {
            let at = self.free;
            self.free = self.links[at as usize].1;
            self.links[at as usize] = link;
            at
        };
        self.heads[bucket] = at;
        self.front = self.front.min(bucket);
        self.len += 1;
    }

    /// Takes the nearest value, up to the width of a bucket.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<T> {
        if self.len == 0 {
            return None;
        }
        while self.heads[self.front] == NONE {
            self.front += 1;
        }
        let at = self.heads[self.front];
        let (value, next) = self.links[at as usize];
        self.heads[self.front] = next;
        self.links[at as usize].1 = self.free;
        self.free = at;
        self.len -= 1;
        Some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearer_buckets_come_first_and_nothing_is_lost() {
        let mut queue = NearestFirst::new();
        let depths = [0.5, 0.0, 1.0, f32::INFINITY, 1e-30, 0.25, 0.5001, 1e-3];
        for (i, &d) in depths.iter().enumerate() {
            queue.push(i, d);
        }
        let mut last = 0;
        let mut seen = Vec::new();
        while let Some(i) = queue.pop() {
            assert!(bucket_of(depths[i]) >= last);
            last = bucket_of(depths[i]);
            seen.push(i);
        }
        seen.sort_unstable();
        assert_eq!(seen, (0..depths.len()).collect::<Vec<_>>());
    }
}
