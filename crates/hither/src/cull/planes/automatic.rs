//! How many occluders, and how deep a tree, by measured gain: what the paper leaves to the user (§5).
//!
//! Gain and cost are counts, not times, so that the same walk gives the same answers on every machine: a
//! polygon that need not be drawn is worth [`POLYGON`] tests of an occluder against a box.
//!
//! *Occluders.* They are ranked by area-angle. After each eye, what the lower half of them hid (nodes that
//! took an occluder of the lower half to hide) is held against the tests that they took part in; the number
//! grows by a quarter where they paid more than twice, and shrinks by a fifth where they did not pay.
//!
//! *Leaves.* Trees of several sizes of leaf look around from a few places at polygons all over the scene;
//! the tree whose tests and remaining polygons cost least is taken.

use super::culler::{MOST_OCCLUDERS, PlaneCuller};
use super::frame::{Frame, NOBODY};
use super::model::PolygonModel;
use super::occluder::Occluders;
use super::visible::Memory;
use super::{Amount, PlanesOptions};
use glam::DVec3;

/// Tests that a polygon less is worth.
const POLYGON: f64 = 6.0;
/// Tests that choosing an occluder and making its planes cost.
const OCCLUDER: f64 = 8.0;
/// Occluders to begin with.
pub(super) const FIRST_COUNT: usize = 32;
/// Tries at a first eye.
pub(super) const FIRST_ROUNDS: usize = 10;
/// Never fewer: as many as the paper has.
const FEWEST_OCCLUDERS: usize = 32;
/// Sizes of leaf that are tried.
const LEAF_SIZES: [usize; 4] = [2, 4, 8, 16];
/// With more polygons the trial would take longer than it saves; then this size is taken.
const MOST_TRIED: usize = 50_000;
const UNTRIED_SIZE: usize = 8;
/// Places from which they are tried.
const PLACES: usize = 12;

/// What the lower half of the occluders did.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gain {
    half: u16,
    hidden: f64,
    tests: f64,
}

impl Gain {
    /// For `count` occluders in use.
    pub fn new(count: usize) -> Gain {
        let half = count / 2;
        Gain { half: half as u16, hidden: 0.0, tests: OCCLUDER * (count - half) as f64 }
    }

    /// Notes what was tested at a node: the lower half has its share by heads.
    pub fn note_work(&mut self, memory: &Memory, frame: &Frame) {
        let (all, lower) = self.heads(memory.arrived(), frame);
        if lower > 0 {
            self.tests += f64::from(memory.effort) * f64::from(lower) / f64::from(all);
        }
    }

    /// Notes that a node with so many pieces is hidden.
    pub fn note_hidden(&mut self, memory: &Memory, frame: &Frame, pieces: usize) {
        if self.heads(&memory.hidden_by, frame).1 > 0 {
            self.hidden += pieces as f64;
        }
    }

    /// Notes the hidden pieces of a leaf, for each of which `memory` has an occluder.
    pub fn note_pieces(&mut self, memory: &Memory, frame: &Frame) {
        self.hidden += f64::from(self.heads(&memory.hidden_by, frame).1);
    }

    /// How many occluders there are, and how many of them are of the lower half.
    fn heads(&self, ids: &[u32], frame: &Frame) -> (u32, u32) {
        let slots = ids.iter().map(|&id| frame.slot(id)).filter(|&slot| slot != NOBODY);
        let ranks = slots.map(|slot| frame.active[usize::from(slot)].rank);
        ranks.fold((0, 0), |(all, lower), rank| (all + 1, lower + u32::from(rank >= self.half)))
    }
}

/// How many occluders to use next.
pub(super) fn next_count(count: usize, gain: &Gain) -> usize {
    let (worth, cost) = (gain.hidden * POLYGON, gain.tests);
    if worth > 2.0 * cost {
        (count * 5).div_ceil(4).min(MOST_OCCLUDERS)
    } else if worth < cost {
        (count * 4 / 5).max(FEWEST_OCCLUDERS)
    } else {
        count
    }
}

/// The size of leaf that costs least.
pub(super) fn leaf_polygons(model: &PolygonModel, occluders: &Occluders, options: &PlanesOptions) -> usize {
    if model.polygons().len() > MOST_TRIED {
        return UNTRIED_SIZE;
    }
    let options = PlanesOptions { occluders: Amount::Fixed(FIRST_COUNT), threads: 1, ..*options };
    let eyes = places(model);
    let cost = |size: usize| -> f64 {
        let mut culler = PlaneCuller::with_leaves(model.clone(), occluders.clone(), &options, size);
        let looks = eyes.iter().filter_map(|&eye| culler.look_around(eye).ok());
        looks.map(|c| c.work.tests() as f64 + POLYGON * c.visible.len() as f64).sum()
    };
    let costs = LEAF_SIZES.map(|size| (cost(size), size));
    costs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or(LEAF_SIZES[0], |(_, size)| size)
}

/// Places a little in front of polygons all over the scene.
fn places(model: &PolygonModel) -> Vec<DVec3> {
    let count = model.polygons().len();
    let before = 0.01 * model.bounds().size().length();
    let place = |i: usize| {
        let corners: Vec<DVec3> = model.corners((i * count / PLACES) as u32).collect();
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        centre + normal.normalize_or(DVec3::Y) * before
    };
    (0..PLACES.min(count)).map(place).collect()
}
