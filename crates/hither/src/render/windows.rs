//! Upright windows of an image, one or two a thread, and how to cut it so that they take about equally long.
//!
//! More windows balance the load, but each walks the tree anew. So the first frame has two a thread, taken as threads
//! become free, and each later one has one a thread, cut by what the windows before cost.

use super::Counters;
use crate::raster::TILE;

/// Windows a thread, as long as nobody knows what they cost.
const AT_FIRST: u32 = 2;

/// Windows are cut anew if the most expensive costs so many times the average.
const UNEVEN: f64 = 1.05;

/// A tile's column costs at least this share of the average, as far as is known: what costs nothing may come to cost.
const LEAST: f64 = 0.01;

/// What the windows of the last frame cost.
#[derive(Debug, Default)]
pub(super) struct Shares {
    width: u32,
    threads: usize,
    /// First column of each window, and whether they cost the same, more or less.
    columns: Vec<u32>,
    even: bool,
    /// What each column of tiles costs, as far as windows, which come to be cut elsewhere, have told.
    tile_costs: Vec<f64>,
}

impl Shares {
    /// Where the image is cut: the first column of each window, a multiple of [`TILE`].
    pub fn columns(&self, width: u32, threads: usize) -> Vec<u32> {
        if threads == 1 {
            return vec![0];
        }
        if (self.width, self.threads) != (width, threads) {
            return equal(width, width.div_ceil(threads as u32 * AT_FIRST).next_multiple_of(64));
        }
        if self.even {
            return self.columns.clone();
        }
        let share = self.tile_costs.iter().sum::<f64>() / threads as f64;
        let (mut columns, mut before) = (vec![0], 0.0);
        for (tile, cost) in self.tile_costs.iter().enumerate() {
            // The border of tiles that is nearest to where the next window would begin.
            let wanted = share * columns.len() as f64;
            if tile > 0 && columns.len() < threads && before + cost / 2.0 > wanted {
                columns.push(tile as u32 * TILE);
            }
            before += cost;
        }
        columns
    }

    /// Remembers what windows cost.
    pub fn learn(&mut self, width: u32, threads: usize, columns: &[u32], counters: &[Counters]) {
        if (self.width, self.threads) != (width, threads) {
            (self.width, self.threads) = (width, threads);
            self.tile_costs.clear();
            self.tile_costs.resize(width.div_ceil(TILE) as usize, 1.0);
        }
        self.columns.clear();
        self.columns.extend_from_slice(columns);
        let ends = columns.iter().skip(1).copied().chain([width]);
        let (mut most, mut sum) = (0.0, 0.0);
        for ((&from, to), done) in columns.iter().zip(ends).zip(counters) {
            let tiles = &mut self.tile_costs[(from / TILE) as usize..to.div_ceil(TILE) as usize];
            let (cost, known) = (cost(done), tiles.iter().sum::<f64>());
            let least = cost / tiles.len() as f64 * LEAST;
            tiles.iter_mut().for_each(|tile| *tile = (*tile * cost / known).max(least));
            most = f64::max(most, cost);
            sum += cost;
        }
        self.even = columns.len() == threads && most * threads as f64 <= sum * UNEVEN;
    }
}

/// Windows of a width, as far as they fit.
pub(super) fn equal(width: u32, of_window: u32) -> Vec<u32> {
    (0..width).step_by(of_window as usize).collect()
}

/// Nanoseconds, give or take a fifth, in the scenes that are measured.
fn cost(done: &Counters) -> f64 {
    let (boxes, triangles, pixels) = (done.nodes_visited, done.triangles_drawn, done.pixels_written);
    1.0 + 20.0 * boxes as f64 + 170.0 * triangles as f64 + 3.5 * pixels as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(nodes_visited: u64) -> Counters {
        Counters { nodes_visited, ..Counters::default() }
    }

    #[test]
    fn windows_come_to_cost_the_same() {
        // All there is to do lies between columns 600 and 1300, four fifths of it beyond 900.
        let density = |x: u32| if (900..1300).contains(&x) { 3 } else { u64::from((600..900).contains(&x)) };
        for threads in [2, 3, 7] {
            let mut shares = Shares::default();
            let (mut columns, mut worst) = (vec![], 0.0);
            for frame in 0..12 {
                columns = shares.columns(1920, threads);
                assert!(columns.is_sorted_by(|a, b| a < b) && columns[0] == 0, "{columns:?}");
                assert!(columns.iter().all(|x| x.is_multiple_of(TILE) && *x < 1920), "{columns:?}");
                let ends = columns.iter().skip(1).copied().chain([1920]);
                let work = columns.iter().zip(ends).map(|(&from, to)| boxes((from..to).map(density).sum()));
                let work: Vec<Counters> = work.collect();
                shares.learn(1920, threads, &columns, &work);
                assert_eq!(columns.len() > threads, frame == 0, "{columns:?}");
                worst = work.iter().map(|w| w.nodes_visited).max().unwrap() as f64 / 1500.0 * threads as f64;
            }
            assert!(columns.len() == threads && worst < 1.3, "{threads}: {columns:?} {worst}");
        }
    }

    #[test]
    fn any_number_of_threads_and_any_width_do() {
        for (width, threads) in [(1, 2), (15, 3), (17, 16), (64, 2), (16_384, 5)] {
            let mut shares = Shares::default();
            for frame in 0..4_usize {
                let columns = shares.columns(width, threads);
                assert!(columns[0] == 0 && columns.iter().all(|x| *x < width && x.is_multiple_of(TILE)));
                assert!(columns.is_sorted_by(|a, b| a < b), "{columns:?}");
                let work: Vec<Counters> =
                    (0..columns.len()).map(|i| boxes(((i * 7 + frame) % 3) as u64)).collect();
                shares.learn(width, threads, &columns, &work);
            }
            // Another image is cut as if for the first time.
            assert_eq!(shares.columns(width + 64, threads), Shares::default().columns(width + 64, threads));
            assert_eq!(shares.columns(width, 1), [0]);
        }
    }
}
