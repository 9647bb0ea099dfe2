//! When to start a frame from what the last one showed [Greene 1995, §3.3.3], and when not to.
//!
//! Drawing first what was visible last pays where it keeps a walk from drawing what is then drawn over. A walk
//! that takes everything nearest first draws over little: 1 to 27 % in the scenes of the literature. Then the
//! start costs its bookkeeping and saves nothing. So both ways are tried on consecutive frames, the cheaper one
//! stays, and the other is tried again after a while, less and less often as long as it keeps losing.
//!
//! What counts is the work done ([`Counters`]), not a clock: the same frames come to the same decisions.

use super::Counters;

/// Whether a frame starts from what was visible in the renderer's last one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// Every frame from scratch.
    #[default]
    Never,
    /// Where it saves work, which is tried now and then.
    WherePays,
    /// Every frame but the first.
    Always,
}

/// Frames from one trial of the other way to the next, at first and at most.
const PATIENCE: (u32, u32) = (16, 1024);

/// What one window has learnt.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Choice {
    /// Work of the last frame done each way, from scratch and from the last frame.
    work: [Option<f64>; 2],
    /// Which way stays.
    coherent: bool,
    /// Frames until the other is tried, and how long that was.
    wait: u32,
    patience: u32,
}

impl Choice {
    /// Whether the next frame is to start from the last one.
    pub fn next_is_coherent(&self) -> bool {
        match self.work {
            [None, _] => false,
            [_, None] => true,
            _ => self.coherent != (self.wait == 0),
        }
    }

    /// Whether the next but one may start from the next, which then has to be remembered.
    pub fn remembers(&self) -> bool {
        self.coherent || self.wait <= 1
    }

    /// Takes note of a frame that was done as [`Choice::next_is_coherent`] said.
    pub fn learn(&mut self, counters: &Counters) {
        let was_coherent = self.next_is_coherent();
        let trial = self.work[0].is_some() && (self.work[1].is_none() || self.wait == 0);
        self.work[usize::from(was_coherent)] = Some(work(counters));
        let [Some(scratch), Some(coherent)] = self.work else { return };
        if !trial {
            self.wait -= 1;
            return;
        }
        let coherent = coherent < scratch;
        let same = coherent == self.coherent && self.patience > 0;
        self.patience = if same { (self.patience * 2).min(PATIENCE.1) } else { PATIENCE.0 };
        (self.coherent, self.wait) = (coherent, self.patience);
    }
}

/// About how many nanoseconds what was counted takes.
fn work(counters: &Counters) -> f64 {
    4.0 * counters.nodes_visited as f64
        + 8.0 * counters.triangles_tested as f64
        + counters.pixels_written as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(pixels: u64) -> Counters {
        Counters { pixels_written: pixels, ..Counters::default() }
    }

    /// How many of `frames` frames start from the last one.
    fn coherent_frames(frames: u32, scratch: u64, coherent: u64) -> u32 {
        let mut choice = Choice::default();
        let mut count = 0;
        for _ in 0..frames {
            let next = choice.next_is_coherent();
            assert!(!next || count > 0 || choice.remembers(), "there must be something to start from");
            count += u32::from(next);
            choice.learn(&frame(if next { coherent } else { scratch }));
        }
        count
    }

    #[test]
    fn the_cheaper_way_stays_and_the_other_is_tried_ever_less() {
        let few = coherent_frames(2000, 100, 101);
        assert!((2..10).contains(&few), "{few} trials of what never pays");
        let most = coherent_frames(2000, 150, 100);
        assert!(2000 - most < 12, "{} frames from scratch where that costs more", 2000 - most);
    }

    #[test]
    fn a_scene_that_changes_is_noticed() {
        let mut choice = Choice::default();
        for n in 0..3000 {
            let next = choice.next_is_coherent();
            let pays = n >= 100;
            choice.learn(&frame(if next == pays { 100 } else { 200 }));
        }
        assert!(choice.coherent, "it pays by now");
    }
}
