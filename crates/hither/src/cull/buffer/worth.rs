//! What is worth drawing of a patch, and in which way.

use super::draw::{Open, Standing};
use super::occluder::Patch;

/// So many faces of a convex body take as long as one that is drawn by itself, more or less.
const FACES_OF_A_BODY_FOR_ONE: i64 = 16;

/// Of what has this share of the image around it, or more, so many times as many faces are worth drawing: it may be the one
/// thing that hides all the rest, a hillside, say, as it was scanned.
const LARGE: i64 = 4;
const FACES_OF_A_LARGE_ONE: i64 = 8;

/// Smaller boxes hide too little for what it takes to place them.
const PX_A_FACE_OF_A_BOX: i32 = 32;

/// The convex bodies as which a patch is drawn: itself, if it is one, or, if its pixels are few for its faces, the boxes
/// inside of it. None stands for its faces; `None` for a patch that is not worth drawing.
#[inline(always)]
pub(super) fn bodies<'a>(standing: &Standing<'a>, patch: &'a Patch, open: &Open) -> Option<&'a [Patch]> {
    let pixels = area_of(open.rect);
    let wanted = i64::from(patch.faces) * i64::from(standing.px_a_face);
    let image = i64::from(standing.size[0]) * i64::from(standing.size[1]);
    let least = if pixels * LARGE >= image && patch.inner.is_empty() {
        wanted / FACES_OF_A_LARGE_ONE
    } else {
        wanted
    };
    // Bodies are drawn whole, beyond the near plane of every eye that may come. It is outside of the bounding box, then.
    let whole = open.clear && !standing.plain && standing.erosion(open.depth).is_some();
    if whole && patch.convex.is_some() && pixels * FACES_OF_A_BODY_FOR_ONE >= wanted {
        return Some(std::slice::from_ref(patch));
    }
    if pixels >= least {
        return Some(&[]);
    }
    let inner = &standing.occluder.inner[patch.inner.start as usize..patch.inner.end as usize];
    // Three faces of a box are seen.
    let faces = 3 * inner.len() as i64;
    let worth = pixels >= faces * i64::from(standing.px_a_face.max(PX_A_FACE_OF_A_BOX));
    (whole && faces > 0 && worth).then_some(inner)
}

/// Pixels in a rectangle (inclusive).
#[inline(always)]
pub(super) fn area_of([left, top, right, bottom]: [i32; 4]) -> i64 {
    i64::from(right - left + 1) * i64::from(bottom - top + 1)
}

/// Whether a patch that touches `rect` is better drawn by its outline than face by face.
pub(super) fn is_fine(rect: [i32; 4], faces: usize, px_a_face: i64) -> bool {
    area_of(rect) <= px_a_face * faces as i64
}

/// Pixels in the rectangle around a patch for each of its faces up to which it is drawn by its outline. Beyond that,
/// faces bound each other's depth too loosely, and large ones cost less tile by tile.
pub(super) const PX_A_FINE_FACE: i64 = 128;

/// The same, of what is left where the patch was clipped. It has a few faces near the eye that are larger by far than
/// the rest; filling the rest tile by tile is what would cost.
pub(super) const PX_A_CLIPPED_FACE: i64 = 1024;
