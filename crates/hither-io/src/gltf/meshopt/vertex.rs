//! Attribute streams (mode 0), versions 0 and 1.
//!
//! Elements come in blocks of up to 256; within a block each byte of the element has its own run of
//! differences, in groups of 16 that are packed with as many bits as they need.

use super::{Cursor, Damage, TOO_LONG, TOO_SHORT};

const GROUP: usize = 16;
const BLOCK_BYTES: usize = 8192;
const BLOCK_ELEMENTS: usize = 256;

/// What 32-bit column of the element is told relative to its predecessor, and how.
#[derive(Clone, Copy)]
enum Channel {
    Bytes,
    Words,
    /// Exclusive or, turned right by so many bits.
    Xor(u32),
}

/// `count` elements of `stride` bytes; `stride` is a multiple of 4 up to 256.
pub(super) fn decode(source: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Damage> {
    let (version, tail_at_least) = match source.first() {
        Some(0xa0) => (0, 32),
        Some(0xa1) => (1, 24),
        Some(_) => return Err("it does not begin as attributes of version 0 or 1 do"),
        None => return Err(TOO_SHORT),
    };
    let tail = if version == 0 { stride } else { stride + stride / 4 };
    let body = source.len().checked_sub(1 + tail.max(tail_at_least)).ok_or(TOO_SHORT)?;
    let (baseline, modes) = source[source.len() - tail..].split_at(stride);
    let channels = match version {
        0 => vec![Channel::Bytes; stride / 4],
        _ => modes.iter().map(|&mode| channel(mode)).collect::<Result<_, _>>()?,
    };
    let block = ((BLOCK_BYTES / stride) & !(GROUP - 1)).min(BLOCK_ELEMENTS);
    // The least that a block can take, so that a count alone never asks for memory.
    let least = if version == 0 { stride } else { stride / 4 };
    if count.div_ceil(block).saturating_mul(least) > body {
        return Err(TOO_SHORT);
    }
    let mut cursor = Cursor { rest: &source[1..1 + body] };
    let mut previous = baseline.to_vec();
    let mut out = vec![0; count.checked_mul(stride).ok_or(TOO_SHORT)?];
    // Differences of a block, one run of BLOCK_ELEMENTS for each byte of the element.
    let mut deltas = vec![0u8; BLOCK_ELEMENTS * stride];
    for elements in out.chunks_mut(block * stride) {
        read_block(&mut cursor, version, elements.len() / stride, &mut deltas)?;
        for (c, &channel) in channels.iter().enumerate() {
            let runs = &deltas[4 * c * BLOCK_ELEMENTS..][..4 * BLOCK_ELEMENTS];
            restore(channel, runs, elements, stride, 4 * c, &mut previous);
        }
    }
    if cursor.rest.is_empty() { Ok(out) } else { Err(TOO_LONG) }
}

fn channel(mode: u8) -> Result<Channel, Damage> {
    match (mode & 15, mode >> 4) {
        (0, 0) => Ok(Channel::Bytes),
        (1, 0) => Ok(Channel::Words),
        (2, turn) => Ok(Channel::Xor(turn.into())),
        _ => Err("a channel mode in it is unknown"),
    }
}

/// Fills the first `count` entries of every run of `deltas`.
fn read_block(cursor: &mut Cursor, version: u8, count: usize, deltas: &mut [u8]) -> Result<(), Damage> {
    let runs = deltas.chunks_exact_mut(BLOCK_ELEMENTS);
    let controls = if version == 0 { &[][..] } else { cursor.take(runs.len() / 4)? };
    for (k, run) in runs.enumerate() {
        let widths = match controls.get(k / 4).map(|byte| byte >> (2 * (k % 4)) & 3) {
            None => [0, 2, 4, 8],
            Some(0) => [0, 1, 2, 4],
            Some(1) => [1, 2, 4, 8],
            Some(2) => {
                run[..count].fill(0);
                continue;
            }
            Some(_) => {
                run[..count].copy_from_slice(cursor.take(count)?);
                continue;
            }
        };
        let groups = count.div_ceil(GROUP);
        let headers = cursor.take(groups.div_ceil(4))?;
        for (g, group) in run.chunks_exact_mut(GROUP).take(groups).enumerate() {
            let width = widths[usize::from(headers[g / 4] >> (2 * (g % 4)) & 3)];
            read_group(cursor, width, group)?;
        }
    }
    Ok(())
}

/// Sixteen values of `width` bits; one with all bits set stands for a whole byte that follows.
fn read_group(cursor: &mut Cursor, width: usize, group: &mut [u8]) -> Result<(), Damage> {
    match width {
        0 => group.fill(0),
        8 => group.copy_from_slice(cursor.take(GROUP)?),
        _ => {
            let packed = cursor.take(2 * width)?;
            let sentinel = (1u8 << width) - 1;
            let per_byte = 8 / width;
            for (i, value) in group.iter_mut().enumerate() {
                let within = i % per_byte;
                // Single bits are packed from the lowest on, pairs and nibbles from the highest.
                let place = if width == 1 { within } else { per_byte - 1 - within };
                let bits = packed[i / per_byte] >> (place * width) & sentinel;
                *value = if bits == sentinel { cursor.byte()? } else { bits };
            }
        }
    }
    Ok(())
}

/// Adds the differences up along four bytes of the elements, `at` to `at + 4`.
fn restore(
    channel: Channel,
    runs: &[u8],
    elements: &mut [u8],
    stride: usize,
    at: usize,
    previous: &mut [u8],
) {
    let (r0, rest) = runs.split_at(BLOCK_ELEMENTS);
    let (r1, rest) = rest.split_at(BLOCK_ELEMENTS);
    let (r2, r3) = rest.split_at(BLOCK_ELEMENTS);
    let mut last = [previous[at], previous[at + 1], previous[at + 2], previous[at + 3]];
    let deltas = r0.iter().zip(r1).zip(r2).zip(r3);
    for (element, (((&d0, &d1), &d2), &d3)) in elements.chunks_exact_mut(stride).zip(deltas) {
        let delta = [d0, d1, d2, d3];
        last = match channel {
            Channel::Bytes => std::array::from_fn(|k| last[k].wrapping_add(unzigzag8(delta[k]))),
            Channel::Words => {
                let low = next_word([last[0], last[1]], [d0, d1]);
                let high = next_word([last[2], last[3]], [d2, d3]);
                [low[0], low[1], high[0], high[1]]
            }
            Channel::Xor(turn) => {
                let change = u32::from_le_bytes(delta).rotate_right(turn);
                (u32::from_le_bytes(last) ^ change).to_le_bytes()
            }
        };
        element[at..at + 4].copy_from_slice(&last);
    }
    previous[at..at + 4].copy_from_slice(&last);
}

fn unzigzag8(code: u8) -> u8 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}

fn next_word(last: [u8; 2], delta: [u8; 2]) -> [u8; 2] {
    let code = u16::from_le_bytes(delta);
    let change = (code >> 1) ^ (code & 1).wrapping_neg();
    u16::from_le_bytes(last).wrapping_add(change).to_le_bytes()
}
