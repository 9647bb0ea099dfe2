//! Equal positions become one vertex: for formats that repeat the corner in every triangle.

use glam::Vec3;
use hashbrown::DefaultHashBuilder;
use hashbrown::hash_table::{Entry, HashTable};
use std::hash::BuildHasher;

/// Collects vertices in the order of their first appearance. Equal means equal in every bit, where −0 is 0.
#[derive(Default)]
pub(crate) struct Welder {
    /// Vertices by their position. Seeded anew in every run, so no file can make it slow.
    table: HashTable<u32>,
    hasher: DefaultHashBuilder,
    positions: Vec<Vec3>,
}

impl Welder {
    /// The vertex at `position`.
    #[inline]
    pub(crate) fn vertex(&mut self, position: Vec3) -> u32 {
        let position = position + Vec3::ZERO;
        let Welder { table, hasher, positions } = self;
        let hash = |p: Vec3| {
            let [x, y, z] = p.to_array().map(f32::to_bits);
            hasher.hash_one((u64::from(x) << 32 | u64::from(y), z))
        };
        let same = |&at: &u32| positions[at as usize] == position;
        match table.entry(hash(position), same, |&at| hash(positions[at as usize])) {
            Entry::Occupied(found) => *found.get(),
            Entry::Vacant(free) => {
                let new = positions.len() as u32;
                free.insert(new);
                positions.push(position);
                new
            }
        }
    }

    /// The vertices.
    pub(crate) fn into_positions(self) -> Vec<Vec3> {
        self.positions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_equal_positions_share_a_vertex() {
        let mut welder = Welder::default();
        let near = f32::from_bits(1.0f32.to_bits() + 1);
        let given = [Vec3::X, Vec3::Y, Vec3::new(1.0, -0.0, 0.0), Vec3::new(near, 0.0, 0.0), Vec3::Y];
        assert_eq!(given.map(|p| welder.vertex(p)), [0, 1, 0, 2, 1]);
        assert_eq!(welder.into_positions(), [Vec3::X, Vec3::Y, Vec3::new(near, 0.0, 0.0)]);
    }
}
