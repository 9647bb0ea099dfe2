//! Where parts are in memory: one after the other as they came in a recent order.
//!
//! A sort goes through its parts front to back and looks at what is near each. Parts are numbered as their owner likes,
//! which is anyhow in space; with a hundred thousand of them each look is then a miss of the caches, and time grows
//! faster than their number. So parts and their pieces have *seats*: places in the lists, given anew whenever many
//! neighbours in the order sit far apart. That is after the first sort, and then seldom, for orders change
//! little from frame to frame. Inside of the sort everything goes by seats; numbers are for its owner.

use super::sort::VisibilitySort;

/// With fewer parts everything is near.
const LEAST_PARTS: usize = 1024;
/// Seats that are in a nearer cache together.
const NEAR: u32 = 1024;

impl VisibilitySort {
    /// Gives seats anew, in the last order, if more than a quarter of its neighbours sit far apart.
    pub(super) fn give_seats(&mut self) {
        let order = &self.seated.parts;
        let apart = order.windows(2).filter(|w| w[0].abs_diff(w[1]) > NEAR).count();
        if self.parts.len() < LEAST_PARTS || apart * 4 <= order.len() {
            return;
        }
        let mut seen = vec![false; self.parts.len()];
        order.iter().for_each(|&part| seen[part as usize] = true);
        let rest = (0..self.parts.len() as u32).filter(|&part| !seen[part as usize]);
        let mut parts = Vec::with_capacity(self.parts.len());
        let mut pieces = Vec::with_capacity(self.pieces.len());
        let mut part_seats = vec![0; self.parts.len()];
        let mut piece_seats = vec![0; self.pieces.len()];
        for (seat, old) in (0u32..).zip(order.iter().copied().chain(rest)) {
            let mut part = self.parts[old as usize];
            part_seats[old as usize] = seat;
            let first_piece = pieces.len() as u32;
            for at in part.pieces() {
                let mut piece = self.pieces[at];
                piece.part = seat;
                piece_seats[at] = pieces.len() as u32;
                pieces.push(piece);
            }
            (part.first_piece, part.end_piece) = (first_piece, pieces.len() as u32);
            self.seats[part.number as usize] = seat;
            parts.push(part);
        }
        self.pairs.move_to(&part_seats, &piece_seats);
        self.seated.parts.iter_mut().zip(0..).for_each(|(part, seat)| *part = seat);
        (self.parts, self.pieces) = (parts, pieces);
    }
}
