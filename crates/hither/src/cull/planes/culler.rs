//! [`PlaneCuller`]: a scene prepared for culling, and what is remembered from eye to eye.

use super::automatic::{self, Gain};
use super::frame::Frame;
use super::model::PolygonModel;
use super::occluder::{Occluder, Occluders};
use super::select::{Potential, best};
use super::tree::Tree;
use super::visible::{Context, Memory, Scratch, State, Subtree, Tests, visit};
use super::{Amount, Culled, PlanesError, PlanesOptions, virtual_occluder};
use crate::conventions::{Projection, View};
use crate::geometry::Aabb;
use crate::scene::Scene;
use glam::DVec3;

/// Most occluders in use at once.
pub(super) const MOST_OCCLUDERS: usize = 1024;
/// Subtrees of fewer nodes are not divided among threads.
const GRAIN: u32 = 96;

/// A scene in one pose, and the eye's last places.
///
/// Cost of a place that is near the last: the nodes at which something changed. Memory: some hundred bytes a
/// node and a polygon.
#[derive(Debug)]
pub struct PlaneCuller {
    options: PlanesOptions,
    pub(super) model: PolygonModel,
    pub(super) occluders: Occluders,
    pub(super) tree: Tree,
    potential: Potential,
    pub(super) present: Sight,
    pub(super) future: Sight,
    /// Whether the last look was a foresight.
    pub(super) foresaw: bool,
    pool: Option<rayon::ThreadPool>,
}

/// What changes from eye to eye.
#[derive(Debug, Default)]
pub(super) struct Sight {
    pub frame: Frame,
    pub memories: Vec<Memory>,
    /// Of each piece, in leaves whose state is partial.
    pub pieces: Vec<State>,
    odometer: f64,
    /// How many occluders are used next; 0 until that is settled.
    occluders: usize,
    began: bool,
    chosen: Vec<(f64, u32, f64)>,
    seen: Vec<bool>,
    /// The planes of the last view, none if it was all around.
    frustum: Vec<(DVec3, f64)>,
    scratch: Scratch,
}

/// What limits a look.
struct Limits<'a> {
    frustum: Option<&'a [(DVec3, f64)]>,
    /// The corners of the part of the view before the near plane: what is cut off there hides nothing.
    unseen: Option<[DVec3; 5]>,
}

impl PlaneCuller {
    /// Prepares `scene`, which must be valid, in its present pose. Cost: n log n in its triangles, instances
    /// counted, several times over where the leaves' size is chosen automatically.
    pub fn new(scene: &Scene, options: &PlanesOptions) -> PlaneCuller {
        let model = PolygonModel::new(scene);
        let mut occluders = Occluders::new(&model);
        if options.virtual_occluders {
            virtual_occluder::add(&model, &mut occluders);
        }
        let leaf_polygons = match options.leaf_polygons {
            Amount::Fixed(n) => n,
            Amount::Automatic => automatic::leaf_polygons(&model, &occluders, options),
        };
        Self::with_leaves(model, occluders, options, leaf_polygons)
    }

    pub(super) fn with_leaves(
        model: PolygonModel,
        occluders: Occluders,
        options: &PlanesOptions,
        leaf_polygons: usize,
    ) -> PlaneCuller {
        let tree = Tree::new(&model, leaf_polygons);
        let potential = Potential::new(&occluders, &tree, options.threshold.max(1e-9));
        let pool = (options.threads != 1)
            .then(|| rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().ok())
            .flatten();
        PlaneCuller {
            options: *options,
            model,
            occluders,
            tree,
            potential,
            present: Sight::default(),
            future: Sight::default(),
            foresaw: false,
            pool,
        }
    }

    /// The polygons that are culled.
    pub fn model(&self) -> &PolygonModel {
        &self.model
    }

    /// Polygons in the leaves, each counted in every leaf that it crosses; nodes; depth of the tree.
    pub fn tree_size(&self) -> (usize, usize, u32) {
        (self.tree.pieces.len(), self.tree.nodes.len(), self.tree.depth)
    }

    /// How many occluders are used for the next eye.
    pub fn occluder_count(&self) -> usize {
        self.present.count(&self.options)
    }

    /// What may be seen from `eye`, looking all around.
    pub fn look_around(&mut self, eye: DVec3) -> Result<Culled, PlanesError> {
        self.look_from(eye, 0.0, &Limits { frustum: None, unseen: None })
    }

    /// What may be seen in `view`. What its near plane cuts off hides nothing.
    pub fn look(&mut self, view: &View) -> Result<Culled, PlanesError> {
        view.validate()?;
        let Projection::Perspective { near, .. } = view.projection else {
            return Err(PlanesError::Orthographic);
        };
        let world_from_view = view.view_from_world.inverse();
        let eye = world_from_view.translation;
        let half_height = 0.5 * f64::from(view.height) / view.pixels_per_unit();
        let half_width = half_height * f64::from(view.width) / f64::from(view.height);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let ray = |(x, y): (f64, f64)| {
            world_from_view.transform_vector3(DVec3::new(x * half_width, y * half_height, -1.0))
        };
        let rays = corners.map(ray);
        let plane = |n: DVec3, through: DVec3| {
            let n = n.normalize_or_zero();
            // Widened by more than rounding.
            let size = through.abs().max_element() + near;
            (n, n.dot(through) - 1e-9 * size)
        };
        let axis = world_from_view.transform_vector3(DVec3::NEG_Z);
        let mut frustum: Vec<(DVec3, f64)> =
            (0..4).map(|i| plane(rays[(i + 1) % 4].cross(rays[i]), eye)).collect();
        // The sides' normals point inwards.
        for side in &mut frustum {
            if side.0.dot(axis) < 0.0 {
                *side = plane(-side.0, eye);
            }
        }
        // Where view space is sheared or stretched, its axis is not at right angles to the near plane.
        frustum.push(plane(-view.view_from_world.matrix3.row(2), eye + axis * near));
        let mut unseen = [eye; 5];
        for (corner, ray) in unseen[1..].iter_mut().zip(rays) {
            *corner = eye + ray * near;
        }
        self.look_from(eye, 0.0, &Limits { frustum: Some(&frustum), unseen: Some(unseen) })
    }

    /// What may be seen from any eye within `reach` metres of `eye`, looking all around: a bound on what
    /// will be visible, found before the eye gets there. It leaves what [`PlaneCuller::look_around`]
    /// remembers alone. Separate occluders are not tried together here.
    pub fn foresee(&mut self, eye: DVec3, reach: f64) -> Result<Culled, PlanesError> {
        std::mem::swap(&mut self.present, &mut self.future);
        if self.present.frame.reach != reach {
            self.present = Sight::default();
        }
        let culled = self.look_from(eye, reach, &Limits { frustum: None, unseen: None });
        std::mem::swap(&mut self.present, &mut self.future);
        self.foresaw = culled.is_ok();
        culled
    }

    /// Polygons that may be occluders: opaque ones, coplanar neighbours joined, and virtual ones.
    pub fn occluder_total(&self) -> usize {
        self.occluders.all.len()
    }

    /// What the last look knows of each polygon, by number; all outside before the first. Visible and partial ones
    /// are those of [`Culled::visible`]; partial is that of which some part may be hidden. Of a polygon that the
    /// view's border crosses the parts in the view count. Cost: all pieces.
    pub fn polygon_states(&self) -> Vec<State> {
        let sight = if self.foresaw { &self.future } else { &self.present };
        sight.polygon_states(&self.tree, self.model.polygons().len())
    }

    /// Forgets what is known of the nodes, as if the next eye were the first; not how many occluders paid.
    pub fn forget_nodes(&mut self) {
        self.present.memories.iter_mut().for_each(Memory::forget);
    }

    /// Forgets the eye's last places, and how many occluders paid there.
    pub fn forget(&mut self) {
        (self.present, self.future) = (Sight::default(), Sight::default());
    }

    fn look_from(&mut self, eye: DVec3, reach: f64, limits: &Limits) -> Result<Culled, PlanesError> {
        if !eye.is_finite() || !reach.is_finite() || reach < 0.0 {
            return Err(PlanesError::Eye);
        }
        self.foresaw = false;
        let automatic = self.options.occluders == Amount::Automatic;
        // At a first eye the number of occluders is not known yet: it is settled by trying.
        let rounds = if automatic && !self.present.began { automatic::FIRST_ROUNDS } else { 1 };
        let mut culled = Culled::default();
        for _ in 0..rounds {
            let count = self.present.count(&self.options);
            let mut gain = Gain::new(count);
            culled = self.look_with(eye, reach, limits, count, automatic.then_some(&mut gain));
            if automatic {
                self.present.occluders = automatic::next_count(count, &gain);
            }
            if self.present.occluders == count {
                break;
            }
        }
        Ok(culled)
    }

    fn look_with(
        &mut self,
        eye: DVec3,
        reach: f64,
        limits: &Limits,
        count: usize,
        gain: Option<&mut Gain>,
    ) -> Culled {
        let PlaneCuller { options, model, occluders, tree, potential, present: sight, .. } = self;
        sight.move_to(eye, tree, model);
        sight.frustum.clear();
        sight.frustum.extend(limits.frustum.into_iter().flatten());
        best(occluders, potential.of(tree.leaf_of(eye)), eye, count, &mut sight.chosen);
        let usable = |o: &Occluder| limits.unseen.is_none_or(|unseen| keeps_clear(o, &unseen));
        sight.frame.begin(occluders, eye, reach, &sight.chosen, usable);
        let context = Context {
            tree,
            frame: &sight.frame,
            tests: Tests { connected: options.connected, fusion: options.fusion, pieces: options.pieces },
            odometer: sight.odometer,
            frustum: limits.frustum,
            grain: if self.pool.is_some() { GRAIN } else { u32::MAX },
        };
        let ids: Vec<u32> = sight.frame.active.iter().map(|a| a.id).collect();
        let (memories, pieces) = (&mut sight.memories, &mut sight.pieces);
        let scratch = &mut sight.scratch;
        let mut run = || visit(&context, Subtree { node: 0, memories, pieces }, &ids, scratch).0;
        let work = match &self.pool {
            Some(pool) => pool.install(run),
            None => run(),
        };
        let occluders = ids.len();
        let mut culled = Culled { eye, reach, occluders, work, ..Culled::default() };
        sight.gather(tree, limits.frustum, &mut culled, gain);
        culled
    }
}

impl Sight {
    fn count(&self, options: &PlanesOptions) -> usize {
        match (options.occluders, self.occluders) {
            (Amount::Fixed(n), _) => n.min(MOST_OCCLUDERS),
            (Amount::Automatic, 0) => automatic::FIRST_COUNT,
            (Amount::Automatic, n) => n,
        }
    }

    fn move_to(&mut self, eye: DVec3, tree: &Tree, model: &PolygonModel) {
        if self.began {
            // Rounded up: the odometer must not fall behind the eye's way.
            let step = eye.distance(self.frame.eye);
            self.odometer += step * (1.0 + 1e-9);
        } else {
            self.memories = vec![Memory::default(); tree.nodes.len()];
            self.pieces = vec![State::Outside; tree.pieces.len()];
            self.seen = vec![false; model.polygons().len()];
            self.began = true;
        }
    }

    /// Collects the polygons that may be seen, and what each occluder was good for.
    fn gather(
        &mut self,
        tree: &Tree,
        frustum: Option<&[(DVec3, f64)]>,
        culled: &mut Culled,
        mut gain: Option<&mut Gain>,
    ) {
        let inside = |piece: usize| frustum.is_none_or(|planes| is_inside(tree.piece(piece), planes));
        self.seen.fill(false);
        let mut at = 0usize;
        while let Some(node) = tree.nodes.get(at) {
            let memory = &self.memories[at];
            let pieces = node.pieces.0 as usize..node.pieces.1 as usize;
            at += 1;
            if memory.outside {
                at = node.end as usize;
                continue;
            }
            if let Some(gain) = &mut gain {
                gain.note_work(memory, &self.frame);
            }
            match memory.state {
                State::Hidden => {
                    culled.hidden_pieces += pieces.len() as u64;
                    if let Some(gain) = &mut gain {
                        gain.note_hidden(memory, &self.frame, pieces.len());
                    }
                    at = node.end as usize;
                }
                State::Visible => {
                    for piece in pieces {
                        self.seen[tree.pieces[piece].polygon as usize] |= inside(piece);
                    }
                    at = node.end as usize;
                }
                State::Partial if node.right == 0 => {
                    if let Some(gain) = &mut gain {
                        gain.note_pieces(memory, &self.frame);
                    }
                    for piece in pieces {
                        if self.pieces[piece] == State::Hidden {
                            culled.hidden_pieces += 1;
                        } else {
                            self.seen[tree.pieces[piece].polygon as usize] |= inside(piece);
                        }
                    }
                }
                State::Partial | State::Outside => {}
            }
        }
        let seen = self.seen.iter().zip(0u32..).filter(|(seen, _)| **seen);
        culled.visible.extend(seen.map(|(_, number)| number));
    }

    /// What is known of each of so many polygons: of those parts of it that the view holds.
    fn polygon_states(&self, tree: &Tree, count: usize) -> Vec<State> {
        let mut states = vec![State::Outside; count];
        let mut at = 0usize;
        while let (Some(node), Some(memory)) = (tree.nodes.get(at), self.memories.get(at)) {
            let settled = memory.outside || memory.state != State::Partial || node.right == 0;
            at = if settled { node.end as usize } else { at + 1 };
            if !settled || memory.outside {
                continue;
            }
            for piece in node.pieces.0 as usize..node.pieces.1 as usize {
                if !is_inside(tree.piece(piece), &self.frustum) {
                    continue;
                }
                let of_piece = if memory.state == State::Partial { self.pieces[piece] } else { memory.state };
                let of_polygon = &mut states[tree.pieces[piece].polygon as usize];
                *of_polygon = match *of_polygon {
                    State::Outside => of_piece,
                    known if known == of_piece => known,
                    _ => State::Partial,
                };
            }
        }
        states
    }
}

/// Whether a convex piece may reach the inner side of all planes.
fn is_inside(piece: &[DVec3], planes: &[(DVec3, f64)]) -> bool {
    planes.iter().all(|(n, offset)| piece.iter().any(|p| n.dot(*p) >= *offset))
}

/// Whether an occluder stays out of the part of the view before the near plane, given by its corners.
fn keeps_clear(occluder: &Occluder, unseen: &[DVec3; 5]) -> bool {
    // A virtual occluder stands for the surface around it, which is somewhere in its solid's box.
    let bounds = occluder.solid.as_ref().unwrap_or(&occluder.bounds);
    let part = Aabb::around(unseen.iter().copied());
    let slack = 1e-9 * part.min.abs().max(part.max.abs()).max_element();
    let apart = (bounds.min - part.max).max(part.min - bounds.max).max_element();
    if apart > slack {
        return true;
    }
    let heights = unseen.map(|p| p.dot(occluder.normal));
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    occluder.solid.is_none() && (lowest > occluder.slab[1] + slack || highest < occluder.slab[0] - slack)
}
