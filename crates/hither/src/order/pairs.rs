//! Candidate pairs of a frame, each with the witness that it had in the last frame.
//!
//! A part that is visited lists its possible occluders once; the list is the cache, too: the next frame looks a
//! pair up in the list of the same part, at about the same place. A pair that is not listed again is forgotten
//! after one frame, as in [Snyder & Lengyel 1997, §6].

use crate::geometry::Witness;

/// `front` may occlude part of `behind`; both are pieces, by their seats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) front: u32,
    pub(super) behind: u32,
}

/// This frame's pairs, in runs of one part each, and the last frame's.
#[derive(Debug, Default)]
pub(super) struct Pairs {
    pub(super) pairs: Vec<Pair>,
    pub(super) witnesses: Vec<Witness>,
    /// For each part its run.
    runs: Vec<(u32, u32)>,
    old_pairs: Vec<Pair>,
    old_witnesses: Vec<Witness>,
    old_runs: Vec<(u32, u32)>,
}

impl Pairs {
    /// This frame becomes the last.
    pub(super) fn turn(&mut self, parts: usize) {
        std::mem::swap(&mut self.pairs, &mut self.old_pairs);
        std::mem::swap(&mut self.witnesses, &mut self.old_witnesses);
        std::mem::swap(&mut self.runs, &mut self.old_runs);
        self.pairs.clear();
        self.witnesses.clear();
        self.runs.clear();
        self.runs.resize(parts, (0, 0));
        self.old_runs.resize(parts, (0, 0));
    }

    /// The parts and pieces of the last frame have moved to other seats.
    pub(super) fn move_to(&mut self, part_seats: &[u32], piece_seats: &[u32]) {
        let seat = |piece: u32| piece_seats[piece as usize];
        for pair in &mut self.pairs {
            *pair = Pair { front: seat(pair.front), behind: seat(pair.behind) };
        }
        let mut runs = vec![(0, 0); part_seats.len()];
        self.runs.iter().zip(part_seats).for_each(|(&run, &seat)| runs[seat as usize] = run);
        self.runs = runs;
    }

    /// The pairs from `start` on are those of `part`: finds their witnesses. Returns the run.
    pub(super) fn close(&mut self, part: u32, start: u32) -> (u32, u32) {
        let run = (start, self.pairs.len() as u32);
        self.runs[part as usize] = run;
        let (from, to) = self.old_runs[part as usize];
        let old = &self.old_pairs[from as usize..to as usize];
        let mut cursor = 0;
        for pair in &self.pairs[start as usize..] {
            let after = old[cursor..].iter().position(|p| p == pair).map(|i| cursor + i);
            let found = after.or_else(|| old[..cursor].iter().position(|p| p == pair));
            self.witnesses.push(match found {
                Some(i) => {
                    cursor = i + 1;
                    self.old_witnesses[from as usize + i]
                }
                None => Witness::default(),
            });
        }
        run
    }
}
