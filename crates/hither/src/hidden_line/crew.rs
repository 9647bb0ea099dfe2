//! Who does the work: one thread, or all of the pool that a drawing is made in.
//!
//! Work is cut into shares whose results do not depend on which thread does which, and come back in order. So
//! a drawing does not depend on the number of threads.

use rayon::prelude::*;
use std::ops::Range;

/// The threads of a drawing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crew {
    pub threads: usize,
}

/// Fewer things than this are not worth being shared.
const FEW: usize = 4096;

impl Crew {
    /// The threads of the pool that this is called in.
    pub fn here() -> Crew {
        Crew { threads: rayon::current_num_threads() }
    }

    /// Does the work inside the pool: from outside, each piece would be handed in by itself.
    pub fn inside<R: Send>(self, work: impl FnOnce() -> R + Send) -> R {
        if self.threads == 1 { work() } else { rayon::scope(|_| work()) }
    }

    /// Does two things, at the same time if there are two threads.
    pub fn both<A: Send, B: Send>(
        self,
        first: impl FnOnce() -> A + Send,
        second: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        if self.threads == 1 { (first(), second()) } else { rayon::join(first, second) }
    }

    /// Ranges of about equal length that together are `0..count`, `each` for a thread; one if there is one
    /// thread.
    pub fn ranges(self, count: usize, each: usize) -> Vec<Range<usize>> {
        let shares = if self.threads > 1 { self.threads * each } else { 1 };
        let length = count.div_ceil(shares).max(1);
        (0..count).step_by(length).map(|at| at..(at + length).min(count)).collect()
    }

    /// [`Crew::ranges`] of many things, or one range of few.
    pub fn shares(self, count: usize, each: usize) -> Vec<Range<usize>> {
        if self.is_shared(count) { self.ranges(count, each) } else { std::iter::once(0..count).collect() }
    }

    /// Whether so many things are worth being shared.
    fn is_shared(self, count: usize) -> bool {
        self.threads > 1 && count >= FEW
    }

    /// Does every piece of work; the results in the order of the work.
    pub fn map<T: Send, R: Send>(self, work: Vec<T>, each: impl Fn(T) -> R + Sync) -> Vec<R> {
        self.map_with(work, || (), |(), t| each(t))
    }

    /// [`Crew::map`], with something that each thread keeps from piece to piece.
    pub fn map_with<T: Send, R: Send, S>(
        self,
        work: Vec<T>,
        start: impl Fn() -> S + Sync,
        each: impl Fn(&mut S, T) -> R + Sync,
    ) -> Vec<R> {
        if self.threads > 1 && work.len() > 1 {
            return work.into_par_iter().map_init(&start, &each).collect();
        }
        let mut state = start();
        work.into_iter().map(|t| each(&mut state, t)).collect()
    }

    /// Adds what `each` makes of the numbers below `count`.
    pub fn extend<R: Send>(self, to: &mut Vec<R>, count: usize, each: impl Fn(usize) -> R + Sync) {
        if self.is_shared(count) {
            to.par_extend((0..count).into_par_iter().with_min_len(FEW).map(&each));
        } else {
            to.extend((0..count).map(each));
        }
    }

    /// Sorts; what has the same key stays in order.
    pub fn sort_by_key<T: Send, K: Ord>(self, list: &mut [T], key: impl Fn(&T) -> K + Sync) {
        if self.is_shared(list.len()) {
            list.par_sort_by_key(key);
        } else {
            list.sort_by_key(key);
        }
    }
}
