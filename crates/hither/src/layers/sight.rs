//! Which parts occlude which in one picture, sample by sample.
//!
//! Hulls fill holes, and a plain's hull holds whatever stands on it: seen by their hulls, all parts of a castle are one
//! cycle. Compositing asks for less. It restores a picture if, wherever two parts are drawn at the same sample, what
//! is drawn of the one is before what is drawn of the other, and never the other way round elsewhere. So each part is
//! drawn alone, and at each sample the parts there are sorted by depth: the rasterised query as one more answer to
//! *does A occlude B from here?*, asked only of parts that are in a cycle by their hulls.
//!
//! What a part shows at a sample is one depth, or with blended surfaces all from its nearest fragment to its farthest.
//! Two parts whose ranges overlap occlude each other. Equal depths are decided as in the whole picture.
//!
//! Parts whose surfaces pass through each other occlude each other even so. They can be kept apart by cutting not them
//! but their pictures: in some order, each loses the samples where a later one is before it ([`Sight::held_out`]).
//! What is drawn of each is then less than all of it, which shows if another is taken away.
//!
//! The answer holds for this view at this size; that of hulls holds wherever the view turns, at any size.

use super::paint::{LayerPainter, PaintOptions};
use crate::conventions::{Projection, View, ViewError};
use crate::render::{BlendedTriangles, Fragment};
use crate::scene::Content;
use glam::DVec2;
use rayon::prelude::*;
use std::ops::Range;

/// No part.
const NONE: u32 = u32::MAX;

/// What is drawn of a part alone: the depth of its surfaces within a rectangle, 0 where there is none.
struct Relief {
    columns: Range<u32>,
    rows: Range<u32>,
    /// Depth, and which instance it is of.
    depths: Vec<(f32, u32)>,
}

/// What is drawn of a part at a sample. Depths are larger where nearer.
#[derive(Clone, Copy, Debug)]
struct Seen {
    column: u32,
    part: u32,
    near: f32,
    far: f32,
    instance: u32,
    /// One surface, not several.
    single: bool,
}

/// What is drawn of some parts in one picture, each alone. Parts are numbered by their places in the list that was
/// looked at.
pub struct Sight {
    fine: View,
    reliefs: Vec<Relief>,
    /// Whether a part has blended surfaces that show.
    blended: Vec<bool>,
    /// For each part at how many samples it is before each other; empty if nowhere.
    before: Vec<Vec<u32>>,
}

impl LayerPainter {
    /// Looks at parts, each a list of instances. Cost: a drawing of each part without shading, and the square of the
    /// parts at a sample; memory: eight bytes a sample of the rectangle around each part, four a pair.
    pub fn look(
        &mut self,
        parts: &[Vec<u32>],
        view: &View,
        options: &PaintOptions,
    ) -> Result<Sight, ViewError> {
        let fine = options.fine(view);
        let mut reliefs = Vec::with_capacity(parts.len());
        for instances in parts {
            reliefs.push(self.relief(instances, &fine, options)?);
        }
        let all: Vec<u32> = parts.iter().flatten().copied().collect();
        self.show(&all, view);
        let scene = self.index.scene();
        let found = options.shading.shows_blended().then(|| BlendedTriangles::find(scene, &fine));
        let is_blended = |&instance: &u32| match scene.groups[0].nodes[instance as usize].content {
            Content::Mesh(mesh) => {
                scene.meshes[mesh as usize].primitives.iter().any(|p| scene.is_blended(p.material))
            }
            _ => false,
        };
        let blended = parts.iter().map(|p| found.is_some() && p.iter().any(is_blended)).collect();
        let mut part_of = vec![NONE; self.poses.len()];
        for (part, instances) in parts.iter().enumerate() {
            instances.iter().for_each(|&i| part_of[i as usize] = part as u32);
        }
        let band = fine.height.div_ceil(rayon::current_num_threads() as u32).max(1);
        let counted = |from: u32| {
            let mut counts = Counts::new(parts.len());
            for y in from..fine.height.min(from + band) {
                let fragments = found.as_ref().map_or_else(Vec::new, |b| b.fragments(y..y + 1));
                counts.row(&seen_in(y, fine.width, &reliefs, &fragments, &part_of));
            }
            counts.flush();
            counts
        };
        let bands: Vec<u32> = (0..fine.height).step_by(band as usize).collect();
        let counts: Vec<Counts> = bands.into_par_iter().map(counted).collect();
        let sum = counts.into_iter().reduce(Counts::with).unwrap_or_else(|| Counts::new(parts.len()));
        Ok(Sight { fine, reliefs, blended, before: sum.before })
    }

    fn relief(
        &mut self,
        instances: &[u32],
        fine: &View,
        options: &PaintOptions,
    ) -> Result<Relief, ViewError> {
        let (columns, rows) = self.rectangle(instances, fine);
        let mut relief = Relief { columns: columns.clone(), rows: rows.clone(), depths: Vec::new() };
        if columns.is_empty() || rows.is_empty() {
            return Ok(relief);
        }
        self.show(instances, fine);
        let frame = self.renderer.render(&self.index, fine, &options.render)?;
        relief.depths.reserve_exact(columns.len() * rows.len());
        for y in rows {
            relief.depths.extend(columns.clone().map(|x| match frame.id(x, y) {
                Some(id) => (frame.depth(x, y), id.instance),
                None => (0.0, NONE),
            }));
        }
        self.renderer.recycle(frame);
        Ok(relief)
    }

    /// Columns and rows outside of which nothing of these instances is drawn.
    fn rectangle(&self, instances: &[u32], view: &View) -> (Range<u32>, Range<u32>) {
        let scene = self.index.scene();
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for &instance in instances {
            let Content::Mesh(mesh) = scene.groups[0].nodes[instance as usize].content else { continue };
            let view_from_mesh = view.view_from_world * self.poses[instance as usize];
            let bounds = scene.meshes[mesh as usize].bounds().transformed(&view_from_mesh);
            if bounds.is_empty() {
                continue;
            }
            let (nearest, farthest) = (-bounds.max.z, -bounds.min.z);
            let scales = match view.projection {
                Projection::Perspective { near, .. } if farthest < near => continue,
                Projection::Perspective { near, .. } if nearest < near => {
                    return (0..view.width, 0..view.height);
                }
                Projection::Perspective { .. } => [1.0 / nearest, 1.0 / farthest],
                Projection::Orthographic { .. } => [1.0; 2],
            };
            for corner in [bounds.min, bounds.max].into_iter().flat_map(|c| scales.map(|s| c.truncate() * s))
            {
                (low, high) = (low.min(corner), high.max(corner));
            }
        }
        if low.x > high.x {
            return (0..0, 0..0);
        }
        // A pixel more than rounding can move an edge.
        let scale = view.pixels_per_unit();
        let columns = |x: f64| f64::from(view.width) * 0.5 + x * scale;
        let rows = |y: f64| f64::from(view.height) * 0.5 - y * scale;
        let range = |from: f64, to: f64, size: u32| {
            let clamp = |v: f64| v.clamp(0.0, f64::from(size)) as u32;
            clamp((from - 1.0).floor())..clamp((to + 1.0).ceil())
        };
        let across = range(columns(low.x), columns(high.x), view.width);
        (across, range(rows(high.y), rows(low.y), view.height))
    }
}

/// What is drawn in a row: by column, then nearest first, equals as the whole picture has them.
fn seen_in(y: u32, width: u32, reliefs: &[Relief], fragments: &[Fragment], part_of: &[u32]) -> Vec<Seen> {
    let mut seen = Vec::new();
    for (relief, part) in reliefs.iter().zip(0..).filter(|(r, _)| r.rows.contains(&y)) {
        let from = (y - relief.rows.start) as usize * relief.columns.len();
        let depths = &relief.depths[from..from + relief.columns.len()];
        for (column, &(depth, instance)) in relief.columns.clone().zip(depths).filter(|(_, d)| d.0 > 0.0) {
            seen.push(Seen { column, part, near: depth, far: depth, instance, single: true });
        }
    }
    if !fragments.is_empty() {
        seen = with_fragments(seen, y * width, fragments, part_of);
    }
    // A depth is never negative, so its bits sort as it does.
    seen.sort_unstable_by_key(|s| (s.column, !s.near.to_bits(), s.instance));
    seen
}

/// Adds fragments that their own part's surfaces do not hide. `first` is the row's first pixel.
fn with_fragments(mut seen: Vec<Seen>, first: u32, fragments: &[Fragment], part_of: &[u32]) -> Vec<Seen> {
    seen.sort_unstable_by_key(|s| (s.column, s.part));
    let solid = seen.clone();
    for fragment in fragments {
        let (column, part) = (fragment.pixel - first, part_of[fragment.id.instance as usize]);
        if part == NONE {
            continue;
        }
        let at = solid.binary_search_by_key(&(column, part), |s| (s.column, s.part));
        if at.is_ok_and(|at| solid[at].near > fragment.depth) {
            continue;
        }
        let (near, instance) = (fragment.depth, fragment.id.instance);
        seen.push(Seen { column, part, near, far: near, instance, single: true });
    }
    seen.sort_unstable_by_key(|s| (s.column, s.part, !s.near.to_bits(), s.instance));
    let mut joined: Vec<Seen> = Vec::with_capacity(seen.len());
    for s in seen {
        match joined.last_mut() {
            Some(last) if (last.column, last.part) == (s.column, s.part) => {
                (last.far, last.single) = (s.far, false);
            }
            _ => joined.push(s),
        }
    }
    joined
}

impl Sight {
    /// The arcs (occluder, occluded), ascending.
    pub fn arcs(&self) -> Vec<(u32, u32)> {
        let row = |(front, counts): (u32, &Vec<u32>)| {
            let behind = (0..).zip(counts).filter(|(_, n)| **n > 0).map(move |(behind, _)| (front, behind));
            behind.collect::<Vec<_>>()
        };
        (0..).zip(&self.before).flat_map(row).collect()
    }

    /// Says that `front` does not occlude `behind`, whatever the samples say: pieces of one surface that overlap are at
    /// one depth there, up to rounding.
    pub fn rule_out(&mut self, front: u32, behind: u32) {
        if let Some(samples) = self.before[front as usize].get_mut(behind as usize) {
            *samples = 0;
        }
    }

    /// At how many samples `front` is before `behind`.
    fn samples_before(&self, front: u32, behind: u32) -> u32 {
        self.before[front as usize].get(behind as usize).copied().unwrap_or(0)
    }

    /// Whether [`Sight::held_out`] can keep these parts apart: none has blended surfaces, which lie before and behind
    /// another at one sample.
    pub fn can_hold_out(&self, parts: &[u32]) -> bool {
        parts.iter().all(|&part| !self.blended[part as usize])
    }

    /// Parts in an order that few samples contradict, and what to cut from each so that none does. Cost: the square
    /// of their number.
    ///
    /// The order is that of [Eades, Lin & Smyth 1993] for the arcs to leave out of a graph so that it has no cycle:
    /// next is whoever is before the others most often, and behind them least; then neighbours change places where
    /// that helps.
    pub fn held_out(&self, parts: &[u32]) -> Vec<(u32, Holdout)> {
        let mut left = parts.to_vec();
        let lead =
            |a: u32, b: u32| i64::from(self.samples_before(a, b)) - i64::from(self.samples_before(b, a));
        let mut score: Vec<i64> = left.iter().map(|&a| left.iter().map(|&b| lead(a, b)).sum()).collect();
        let mut order: Vec<u32> = Vec::with_capacity(left.len());
        while let Some(best) = (0..left.len()).max_by_key(|&i| (score[i], std::cmp::Reverse(i))) {
            let next = left.remove(best);
            score.remove(best);
            score.iter_mut().zip(&left).for_each(|(score, &other)| *score -= lead(other, next));
            order.push(next);
        }
        // Each change of places leaves fewer samples to cut.
        let mut changed = true;
        while changed {
            changed = false;
            for i in 1..order.len() {
                if lead(order[i], order[i - 1]) > 0 {
                    order.swap(i - 1, i);
                    changed = true;
                }
            }
        }
        self.cut(&order)
    }

    /// Each part with the samples where a later one is before it.
    fn cut(&self, order: &[u32]) -> Vec<(u32, Holdout)> {
        let mut place = vec![0; self.reliefs.len()];
        (1..).zip(order).for_each(|(at, &part)| place[part as usize] = at);
        let mut held: Vec<Holdout> = Vec::with_capacity(order.len());
        for &part in order {
            let Relief { columns, rows, .. } = &self.reliefs[part as usize];
            let cut = vec![false; columns.len() * rows.len()];
            held.push(Holdout { columns: columns.clone(), rows: rows.clone(), cut, samples: 0 });
        }
        for y in 0..self.fine.height {
            let seen = seen_in(y, self.fine.width, &self.reliefs, &[], &[]);
            for here in seen.chunk_by(|a, b| a.column == b.column) {
                let mut latest = 0;
                for s in here.iter().filter(|s| place[s.part as usize] > 0) {
                    let at = place[s.part as usize];
                    if at < latest {
                        held[at - 1].add(s.column, y);
                    }
                    latest = latest.max(at);
                }
            }
        }
        order.iter().copied().zip(held).collect()
    }
}

/// Where a part is cut because another is before it: a holdout matte.
#[derive(Clone, Debug)]
pub struct Holdout {
    columns: Range<u32>,
    rows: Range<u32>,
    /// A sample each.
    cut: Vec<bool>,
    samples: u64,
}

impl Holdout {
    /// How many samples are cut.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Whether the sample at (x, y) is cut; samples are numbered as pixels of the finer picture.
    pub(super) fn holds(&self, x: u32, y: u32) -> bool {
        self.place(x, y).is_some_and(|at| self.cut[at])
    }

    fn add(&mut self, x: u32, y: u32) {
        if let Some(at) = self.place(x, y) {
            self.cut[at] = true;
            self.samples += 1;
        }
    }

    fn place(&self, x: u32, y: u32) -> Option<usize> {
        let inside = self.columns.contains(&x) && self.rows.contains(&y);
        let at = || (y - self.rows.start) as usize * self.columns.len() + (x - self.columns.start) as usize;
        inside.then(at)
    }
}

/// Samples counted so far.
struct Counts {
    /// For each part at how many samples it is before each other; empty if nowhere.
    before: Vec<Vec<u32>>,
    /// The parts at the last sample, nearest first, none in the range of another.
    last: Vec<u32>,
    /// At how many samples in a row, not counted yet.
    run: u32,
}

impl Counts {
    fn new(parts: usize) -> Counts {
        Counts { before: vec![Vec::new(); parts], last: Vec::new(), run: 0 }
    }

    fn row(&mut self, seen: &[Seen]) {
        for here in seen.chunk_by(|a, b| a.column == b.column) {
            let same =
                here.len() == self.last.len() && here.iter().zip(&self.last).all(|(s, l)| s.part == *l);
            if !same {
                self.flush();
                self.last.extend(here.iter().map(|s| s.part));
            }
            self.run += 1;
            if here.windows(2).any(|w| w[0].far <= w[1].near && !is_tie(&w[0], &w[1])) {
                for (i, front) in here.iter().enumerate() {
                    let overlapping =
                        here[i + 1..].iter().filter(|b| front.far <= b.near && !is_tie(front, b));
                    overlapping.for_each(|behind| self.add(behind.part, front.part, 1));
                }
            }
        }
    }

    /// Counts the last samples.
    fn flush(&mut self) {
        let (last, run) = (std::mem::take(&mut self.last), std::mem::take(&mut self.run));
        for (i, &front) in last.iter().enumerate() {
            last[i + 1..].iter().for_each(|&behind| self.add(front, behind, run));
        }
        self.last = last;
        self.last.clear();
    }

    fn add(&mut self, front: u32, behind: u32, samples: u32) {
        let parts = self.before.len();
        let counts = &mut self.before[front as usize];
        if counts.is_empty() {
            counts.resize(parts, 0);
        }
        counts[behind as usize] += samples;
    }

    fn with(mut self, other: Counts) -> Counts {
        for (mine, theirs) in self.before.iter_mut().zip(other.before) {
            if mine.is_empty() {
                *mine = theirs;
            } else {
                mine.iter_mut().zip(theirs).for_each(|(m, t)| *m += t);
            }
        }
        self
    }
}

/// Two surfaces at one depth: the smaller instance is seen, here as in the whole picture.
fn is_tie(front: &Seen, behind: &Seen) -> bool {
    front.single && behind.single && front.near == behind.near
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn arcs(seen: &[(u32, f32, f32)]) -> Vec<(u32, u32)> {
        let seen = seen.iter().zip(0..).map(|(&(part, near, far), instance)| Seen {
            column: 0,
            part,
            near,
            far,
            instance,
            single: near == far,
        });
        let mut counts = Counts::new(70);
        counts.row(&seen.collect::<Vec<_>>());
        counts.flush();
        let view = View::look_at(
            DVec3::Z,
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { fov_y: 1.0, near: 0.1 },
            (1, 1),
        );
        Sight { fine: view, reliefs: Vec::new(), blended: Vec::new(), before: counts.before }.arcs()
    }

    #[test]
    fn depths_in_order_are_arcs_one_way_and_ranges_that_overlap_both_ways() {
        assert_eq!(arcs(&[(3, 0.5, 0.5), (69, 0.4, 0.4), (1, 0.1, 0.1)]), [(3, 1), (3, 69), (69, 1)]);
        assert_eq!(arcs(&[(3, 0.5, 0.2), (0, 0.4, 0.3)]), [(0, 3), (3, 0)]);
        assert_eq!(arcs(&[(3, 0.5, 0.2), (0, 0.1, 0.1)]), [(3, 0)]);
        // Equal depths: the first instance is seen; beside a range nobody knows.
        assert_eq!(arcs(&[(5, 0.5, 0.5), (4, 0.5, 0.5)]), [(5, 4)]);
        assert_eq!(arcs(&[(5, 0.5, 0.5), (4, 0.5, 0.4)]), [(4, 5), (5, 4)]);
    }

    #[test]
    fn fragments_behind_their_own_part_do_not_count() {
        let id = |instance| crate::conventions::SurfaceId { instance, triangle: 0 };
        let solid = Seen { column: 2, part: 1, near: 0.5, far: 0.5, instance: 7, single: true };
        let fragment = |depth, instance| Fragment { pixel: 12, depth, id: id(instance) };
        let part_of = [0, 1, NONE, 1, 1, 1, 1, 1];
        let all = [fragment(0.6, 1), fragment(0.4, 1), fragment(0.55, 0), fragment(0.9, 2), fragment(0.3, 0)];
        let seen = with_fragments(vec![solid], 10, &all, &part_of);
        let found: Vec<(u32, f32, f32)> = seen.iter().map(|s| (s.part, s.near, s.far)).collect();
        assert_eq!(found, [(0, 0.55, 0.3), (1, 0.6, 0.5)]);
    }
}
