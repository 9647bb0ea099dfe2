//! Primitives of lines: segments, strips and loops become the mesh's own lines, for drawings.
//!
//! Only positions are read. Of a list of positions that a primitive takes a part of, only that part. A line
//! whose ends are at the same place is dropped; one that touches a position which is no number is told of.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::fault::{Fault, malformed};
use super::json;
use glam::Vec3;

/// How consecutive corners are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Segments,
    Loop,
    Strip,
}

impl Mode {
    fn of(code: u64) -> Option<Mode> {
        match code {
            1 => Some(Mode::Segments),
            2 => Some(Mode::Loop),
            3 => Some(Mode::Strip),
            _ => None,
        }
    }

    /// Number of lines between so many corners.
    fn count(self, corners: usize) -> usize {
        match self {
            Mode::Segments => corners / 2,
            Mode::Strip => corners.saturating_sub(1),
            Mode::Loop if corners < 3 => corners.saturating_sub(1),
            Mode::Loop => corners,
        }
    }

    /// The corners that line `i` joins.
    fn line(self, i: usize, corners: usize) -> [usize; 2] {
        match self {
            Mode::Segments => [2 * i, 2 * i + 1],
            Mode::Strip | Mode::Loop => [i, (i + 1) % corners],
        }
    }
}

/// Whether a primitive is one of lines.
pub(super) fn are_in(primitive: &json::Primitive) -> bool {
    primitive.mode.is_some_and(|mode| Mode::of(mode.0).is_some())
}

/// Appends a primitive's lines; or says what is odd about it.
pub(super) fn read(
    buffers: &Buffers,
    primitive: &json::Primitive,
    lines: &mut Vec<[Vec3; 2]>,
) -> Result<Option<&'static str>, Fault> {
    let Some(mode) = primitive.mode.and_then(|mode| Mode::of(mode.0)) else { return Ok(None) };
    let Some(&position) = primitive.attributes.get("POSITION") else {
        return Ok(Some("has no positions; its lines are left out"));
    };
    let positions = Elements::resolve(buffers, position).map_err(|f| f.at("POSITION"))?;
    let corners = match primitive.indices {
        Some(index) => {
            let indices = Elements::resolve(buffers, index).and_then(|e| e.indices());
            Some(indices.map_err(|f| f.at("indices"))?)
        }
        None => None,
    };
    let count = positions.count();
    if let Some(corners) = &corners
        && let Some(bad) = corners.iter().position(|&i| i as usize >= count)
    {
        let index = corners[bad];
        return malformed(format!("index {bad} is {index}, but there are {count} vertices"));
    }
    let range = match &corners {
        Some(corners) => {
            let first = corners.iter().copied().min().unwrap_or(0) as usize;
            first..corners.iter().copied().max().map_or(first, |last| last as usize + 1)
        }
        None => 0..count,
    };
    let first = range.start;
    let positions: Vec<[f32; 3]> = positions.floats_in(range).map_err(|f| f.at("POSITION"))?;
    let count = corners.as_ref().map_or(positions.len(), Vec::len);
    let at = |i: usize| {
        let element = corners.as_ref().map_or(i, |c| c[i] as usize - first);
        Vec3::from_array(positions[element])
    };
    buffers.spend(24 * mode.count(count) as u64)?;
    let mut broken = false;
    for i in 0..mode.count(count) {
        let ends = mode.line(i, count).map(at);
        if !ends[0].is_finite() || !ends[1].is_finite() {
            broken = true;
        } else if ends[0] != ends[1] {
            lines.push(ends);
        }
    }
    Ok(broken.then_some("has lines that touch a position which is not a finite number; they are left out"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_joined_as_the_mode_says() {
        let of = |mode: Mode, n: usize| -> Vec<[usize; 2]> {
            (0..mode.count(n)).map(|i| mode.line(i, n)).collect()
        };
        assert_eq!(of(Mode::Segments, 5), [[0, 1], [2, 3]]);
        assert_eq!(of(Mode::Strip, 3), [[0, 1], [1, 2]]);
        assert_eq!(of(Mode::Loop, 3), [[0, 1], [1, 2], [2, 0]]);
        assert_eq!(of(Mode::Loop, 2), [[0, 1]]);
        for mode in [Mode::Segments, Mode::Strip, Mode::Loop] {
            assert!(of(mode, 0).is_empty() && of(mode, 1).is_empty());
        }
    }
}
