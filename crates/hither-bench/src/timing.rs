//! Times as medians of repeated runs: a run that was disturbed does not count.

use crate::Options;
use std::time::{Duration, Instant};

/// The median of `sample`, which measures itself, in milliseconds. The first run warms caches up and counts
/// only where there is no time for another.
pub(crate) fn median_ms(options: &Options, mut sample: impl FnMut() -> Duration) -> f64 {
    let start = Instant::now();
    let first = sample();
    let mut times = Vec::new();
    while times.len() < options.most_runs && start.elapsed().as_secs_f64() < options.budget_s {
        times.push(sample());
    }
    if times.is_empty() {
        times.push(first);
    }
    median(&mut times).as_secs_f64() * 1e3
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

    #[test]
    fn the_median_ignores_the_first_run_and_outliers() {
        let mut times = [90u64, 1, 5, 3, 80, 2].map(Duration::from_millis).into_iter();
        let options = Options { most_runs: 5, budget_s: 1e9, ..Options::default() };
        assert_eq!(median_ms(&options, || times.next().unwrap_or_default()), 3.0);
        let hasty = Options { budget_s: 0.0, ..Options::default() };
        assert_eq!(median_ms(&hasty, || Duration::from_millis(7)), 7.0);
    }
}
