//! Times as medians of repeated runs: a run that was disturbed does not count.

use crate::Options;
use std::time::{Duration, Instant};

/// A piece of work that measures itself.
pub(crate) type Sample<'a> = &'a mut dyn FnMut() -> Duration;

/// The median of `sample`, which measures itself, in milliseconds. The first run warms caches up and counts
/// only where there is no time for another.
pub(crate) fn median_ms(options: &Options, mut sample: impl FnMut() -> Duration) -> f64 {
    let [median] = medians_ms(options, [&mut sample]);
    median
}

/// As [`median_ms`] for each of several samples, which run in turns: what slows the machine down for a while then slows
/// all of them. In its turn each runs twice, and the second run counts. One that has had its time or its runs is left out
/// of the turns that follow.
pub(crate) fn medians_ms<const N: usize>(options: &Options, mut samples: [Sample; N]) -> [f64; N] {
    let mut all = [const { Runs { first: None, counted: Vec::new(), spent_s: 0.0 } }; N];
    loop {
        let mut ran = false;
        for (sample, runs) in samples.iter_mut().zip(&mut all) {
            if runs.goes_on(options) && (N > 1 || runs.first.is_none()) {
                let measured = runs.run(sample);
                runs.first.get_or_insert(measured);
                ran = true;
            }
            if runs.goes_on(options) {
                let measured = runs.run(sample);
                runs.counted.push(measured);
                ran = true;
            }
        }
        if !ran {
            return all.map(|runs| runs.median().as_secs_f64() * 1e3);
        }
    }
}

/// What a sample measured so far.
struct Runs {
    first: Option<Duration>,
    counted: Vec<Duration>,
    spent_s: f64,
}

impl Runs {
    fn goes_on(&self, options: &Options) -> bool {
        let (in_time, few) = (self.spent_s < options.budget_s, self.counted.len() < options.most_runs);
        self.first.is_none() || in_time && few
    }

    fn run(&mut self, sample: &mut Sample) -> Duration {
        let (time, measured) = timed(sample);
        self.spent_s += time.as_secs_f64();
        measured
    }

    fn median(mut self) -> Duration {
        if self.counted.is_empty() {
            self.counted.extend(self.first);
        }
        median(&mut self.counted)
    }
}

/// The median duration; the larger of the two middle ones.
pub(crate) fn median(times: &mut [Duration]) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

/// How long `work` takes, and what it returns.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (Duration, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed(), result)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    #[test]
    fn the_median_ignores_the_first_run_and_outliers() {
        let mut times = [90u64, 1, 5, 3, 80, 2].map(Duration::from_millis).into_iter();
        let options = Options { most_runs: 5, budget_s: 1e9, ..Options::default() };
        assert_eq!(median_ms(&options, || times.next().unwrap_or_default()), 3.0);
        let hasty = Options { budget_s: 0.0, ..Options::default() };
        assert_eq!(median_ms(&hasty, || Duration::from_millis(7)), 7.0);
    }

    #[test]
    fn several_samples_run_in_turns() {
        let order = RefCell::new(Vec::new());
        let sample = |k: u64| {
            order.borrow_mut().push(k);
            Duration::from_millis(k)
        };
        let options = Options { most_runs: 2, budget_s: 1e9, ..Options::default() };
        let medians = medians_ms(&options, [&mut || sample(1), &mut || sample(5), &mut || sample(3)]);
        assert_eq!(medians, [1.0, 5.0, 3.0]);
        assert_eq!(*order.borrow(), [1, 1, 5, 5, 3, 3].repeat(2));
    }
}
