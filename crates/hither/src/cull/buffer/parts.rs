//! Parts of a patch that are drawn as chains of their own, where one of them may lie before another.
//!
//! What a patch covers gets, in each block, the least depth of all its faces that touch the block. Where the patch lies
//! before itself (a ridge and the ground behind it, the near and the far walls of a yard), that is the depth of what is
//! behind. Any choice of faces is a chain, in the words of [`super`], with an outline of its own, and hides for itself: so
//! the faces that are drawn are taken apart where no edge connects them; and of a large patch all of whose faces are
//! connected the nearest quarter and the nearer half are drawn first, without the others.
//!
//! What is chosen depends on the patch and the view alone, not on what part of the image is drawn.

use super::fine::plane_of;
use super::occluder::{ENDS, Face, Vertices};
use glam::DVec3;

/// Patches of fewer faces stay whole: they are large, and filled one by one, at depths of their own.
const LEAST_FACES: usize = 64;

/// A patch is taken apart where no edge connects it if its farthest point is so many times as far away as its nearest …
const APART: f32 = 1.25;

/// … and by depth if it is so many times as far away, has so many faces, and the rectangle around it has a share of the
/// image's pixels.
const FAR_APART: f32 = 2.0;
const MANY_FACES: u32 = 512;
const SHARE_OF_IMAGE: i64 = 16;

/// A connected part is drawn by itself if it has at least this share of the faces that are drawn …
const SHARE: usize = 16;

/// … and is among so many, the largest first. What else there is, is a part together.
const MOST_PARTS: usize = 4;

/// Which part each face of a patch belongs to.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    /// The turns of all faces.
    turns: Vec<i8>,
    /// For each face that is drawn its connected part, later its part.
    part: Vec<u32>,
    stack: Vec<u32>,
    /// How many faces each connected part has, and its number.
    sizes: Vec<(u32, u32)>,
    depths: Vec<f32>,
    /// Whether part i is drawn with all that come before it.
    cumulative: bool,
}

const NO_PART: u32 = u32::MAX;

/// How far a patch may be taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Apart {
    Not,
    Unconnected,
    ByDepth,
}

impl Apart {
    /// That of a patch that folds, or not, has so many faces and lies in so many of the image's pixels, between two depths.
    pub fn of(folds: bool, faces: u32, [farthest, nearest]: [f32; 2], pixels: i64, image: i64) -> Apart {
        if !folds || farthest * APART >= nearest {
            return Apart::Not;
        }
        let by_depth =
            farthest * FAR_APART < nearest && faces >= MANY_FACES && pixels * SHARE_OF_IMAGE >= image;
        if by_depth { Apart::ByDepth } else { Apart::Unconnected }
    }
}

impl Parts {
    /// Takes apart the faces of a patch that have a turn. Returns how many parts there are, 1 if it stays whole.
    pub fn find(&mut self, faces: &[Face], turns: &[i8]) -> usize {
        self.turns.clear();
        self.turns.extend_from_slice(&turns[..faces.len()]);
        self.cumulative = false;
        self.connect(faces);
        let drawn: usize = self.sizes.iter().map(|&(size, _)| size as usize).sum();
        self.sizes.sort_unstable_by_key(|&(size, first)| (std::cmp::Reverse(size), first));
        let large = self.sizes.iter().filter(|&&(size, _)| size as usize * SHARE >= drawn).count();
        let alone = large.min(MOST_PARTS);
        if alone < 2 {
            return 1;
        }
        let mut part_of = vec![alone as u32; self.sizes.len()];
        for (part, &(_, connected)) in self.sizes[..alone].iter().enumerate() {
            part_of[connected as usize] = part as u32;
        }
        for part in self.part.iter_mut().filter(|part| **part != NO_PART) {
            *part = part_of[*part as usize];
        }
        alone + usize::from(self.sizes.len() > alone)
    }

    /// Takes the faces of the patch last asked about apart by their depths: the nearest quarter, the next, and the
    /// rest. Returns how many parts there are; where all faces turn away, the patch stays whole.
    pub fn find_near(&mut self, depth: impl Fn(usize) -> f32) -> usize {
        self.depths.clear();
        let drawn = |(_, part): &(usize, &u32)| **part != NO_PART;
        self.depths.extend(self.part.iter().enumerate().filter(drawn).map(|(f, _)| depth(f)));
        let count = self.depths.len();
        if count == 0 {
            return 1;
        }
        let mut nearest = |share: usize| *self.depths.select_nth_unstable_by(share, |a, b| b.total_cmp(a)).1;
        let (quarter, half) = (nearest(count / 4), nearest(count / 2));
        for (f, part) in self.part.iter_mut().enumerate().filter(|(_, part)| **part != NO_PART) {
            let depth = depth(f);
            *part = u32::from(depth < quarter) + u32::from(depth < half);
        }
        self.cumulative = true;
        3
    }

    /// Leaves the faces of one part their turns.
    pub fn choose(&self, part: usize, turns: &mut [i8]) {
        let part = part as u32;
        for ((turn, of_all), of) in turns.iter_mut().zip(&self.turns).zip(&self.part) {
            let chosen = *of == part || (self.cumulative && *of < part);
            *turn = if chosen { *of_all } else { 0 };
        }
    }

    /// Numbers what edges connect of the faces that are drawn.
    fn connect(&mut self, faces: &[Face]) {
        self.part.clear();
        self.part.resize(faces.len(), NO_PART);
        self.sizes.clear();
        for start in 0..faces.len() {
            if self.turns[start] == 0 || self.part[start] != NO_PART {
                continue;
            }
            let connected = self.sizes.len() as u32;
            let mut size = 0;
            self.part[start] = connected;
            self.stack.push(start as u32);
            while let Some(f) = self.stack.pop() {
                size += 1;
                let face = &faces[f as usize];
                for &next in face.across[..usize::from(face.corners)].iter().filter(|next| **next != ENDS) {
                    let at = next as usize;
                    if self.turns[at] == self.turns[f as usize] && self.part[at] == NO_PART {
                        self.part[at] = connected;
                        self.stack.push(next);
                    }
                }
            }
            self.sizes.push((size, connected));
        }
    }
}

/// Whether a surface bends towards its front somewhere, so that some of it may lie before other parts of it.
pub(super) fn folds(faces: &[Face], vertices: &Vertices, first: u32) -> bool {
    let at = |v: u32| {
        let v = (first + v) as usize;
        DVec3::new(vertices.x[v].into(), vertices.y[v].into(), vertices.z[v].into())
    };
    faces.len() >= LEAST_FACES
        && faces.iter().any(|face| {
            let [x, y, z, _] = plane_of(face, vertices, first).map(f64::from);
            let (normal, on_it) = (DVec3::new(x, y, z), at(face.corner[0]));
            let across = face.across[..usize::from(face.corners)].iter().filter(|f| **f != ENDS);
            across.into_iter().any(|&other| {
                faces[other as usize].corner.iter().any(|&v| {
                    let to = at(v) - on_it;
                    normal.dot(to) > BENT * to.length()
                })
            })
        })
}

/// Sine of the angle from which on a surface is bent, not merely rough.
const BENT: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows of squares that no edge connects, and one square by itself.
    fn strips() -> Vec<Face> {
        let face = |f: u32, from: u32, to: u32| {
            let next = |ok: bool, f: u32| if ok { f } else { ENDS };
            let across = [ENDS, next(f + 1 < to, f + 1), ENDS, next(f > from, f.wrapping_sub(1))];
            Face { corner: [0, 1, 2, 3], across, corners: 4, two_sided: false }
        };
        (0..40).map(|f| face(f, if f < 20 { 0 } else { 20 }, if f < 20 { 20 } else { 39 })).collect()
    }

    fn chosen(parts: &Parts, part: usize, count: usize) -> Vec<usize> {
        let mut turns = vec![7; count];
        parts.choose(part, &mut turns);
        (0..count).filter(|&f| turns[f] != 0).collect()
    }

    #[test]
    fn what_no_edge_connects_is_apart_and_what_is_small_comes_last() {
        let (faces, mut parts) = (strips(), Parts::default());
        assert_eq!(parts.find(&faces, &[1; 40]), 3);
        assert_eq!(chosen(&parts, 0, 40), (0..20).collect::<Vec<_>>());
        assert_eq!(chosen(&parts, 1, 40), (20..39).collect::<Vec<_>>());
        assert_eq!(chosen(&parts, 2, 40), [39]);
        // A row of which only some is drawn falls in two.
        let mut turns = [1; 40];
        turns[5] = 0;
        turns[20..].fill(0);
        assert_eq!(parts.find(&faces, &turns), 2);
        assert_eq!(chosen(&parts, 0, 40), (6..20).collect::<Vec<_>>());
        assert_eq!(chosen(&parts, 1, 40), (0..5).collect::<Vec<_>>());
        // So does one that turns over.
        turns[5] = -1;
        assert_eq!(parts.find(&faces, &turns), 3);
        assert_eq!(chosen(&parts, 2, 40), [5]);
    }

    #[test]
    fn what_is_connected_is_drawn_from_near_to_far() {
        let (faces, mut parts) = (strips(), Parts::default());
        let mut turns = [1; 40];
        turns[20..].fill(0);
        assert_eq!(parts.find(&faces, &turns), 1);
        assert_eq!(parts.find_near(|f| f as f32), 3);
        assert_eq!(chosen(&parts, 0, 40), (14..20).collect::<Vec<_>>());
        assert_eq!(chosen(&parts, 1, 40), (9..20).collect::<Vec<_>>());
        assert_eq!(chosen(&parts, 2, 40), (0..20).collect::<Vec<_>>());
    }

    #[test]
    fn what_turns_away_stays_whole() {
        let (faces, mut parts) = (strips(), Parts::default());
        assert_eq!(parts.find(&faces, &[0; 40]), 1);
        assert_eq!(parts.find_near(|f| f as f32), 1);
    }
}
