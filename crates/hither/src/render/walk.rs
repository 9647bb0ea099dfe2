//! The nearest-first walk of a scene's nested trees, drawing as it goes [Greene 1995, §3.3.1].
//!
//! ```text
//! push the root
//! while something is open:
//!     take the nearest open entry; if the z-pyramid hides its rectangle (or its outline, where that is asked
//!     for) at its nearest depth: drop it
//!     a block of triangles: draw it
//!     an instance: enter its tree, with its transform composed in f64
//!     a node: project its sixteen boxes; open those that may hold a pixel centre
//! what lies in an entry of few pixels comes before anything else, nearest first
//! ```
//!
//! The order only saves work: whatever it is, the window ends up the same (see `raster`). Entries are
//! tested when they are taken, not when they are pushed, so that what was drawn meanwhile counts.
//!
//! With a [`Memory`], the blocks that showed in the last frame are drawn first, where that pays, and the walk
//! only fills in what has come into view. A block is remembered as long as the walk finds it in an open leaf.
//!
//! The plain z-buffer is the same walk with every test against the pyramid left out: it visits all that
//! lies in the frustum and draws all of it.

use super::coherence::Choice;
use super::queue::NearestFirst;
use super::{Algorithm, BoxTest, Counters};
use crate::conventions::View;
use crate::index::{BlockTree, Box3, Child, GroupIndex, SceneIndex, Slot, WideTree};
use crate::raster::{
    BoxSet, Drawing, ProjectedBoxes, Rect, ScreenFromObject, Target, TriangleBlock, draw_block, project_boxes,
};
use crate::scene::{Content, Scene};
use fearless_simd::{Level, Simd, dispatch};
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

/// Draws what `index` shows of `view` into one window.
pub(super) fn draw_window(
    level: Level,
    index: &SceneIndex,
    view: &View,
    how: (Algorithm, BoxTest),
    target: &mut Target,
    memory: Option<&mut Memory>,
) -> Counters {
    dispatch!(level, simd => walk(simd, index, view, how, target, memory))
}

/// A tree entered with a transform.
struct Context<'a> {
    space: Space<'a>,
    at: ScreenFromObject,
    boxes: BoxSet,
    /// Number of the instance (or of a group's first).
    instance: u32,
}

#[derive(Clone, Copy)]
enum Space<'a> {
    Mesh { blocks: &'a BlockTree, mesh: u32 },
    Group(&'a GroupIndex),
}

/// Something to be visited: a child of a node, where it lies, and how near it comes.
#[derive(Clone, Copy)]
struct Entry {
    slot: Slot,
    /// Index of its context.
    context: u32,
    place: Place,
    rect: [u16; 4],
    depth: f32,
}

/// Where an entry comes from: a node and a lane of its context's tree, or of its tree of moving items.
/// In 32 bits, for the queue holds hundreds of thousands.
#[derive(Clone, Copy)]
struct Place(u32);

impl Place {
    const MOVING: u32 = 1 << 31;

    #[inline(always)]
    fn new(moving: bool, node: u32) -> Place {
        Place(node << 4 | if moving { Place::MOVING } else { 0 })
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> Place {
        Place(self.0 | lane as u32)
    }

    #[inline(always)]
    fn is_moving(self) -> bool {
        self.0 & Place::MOVING != 0
    }

    #[inline(always)]
    fn node(self) -> usize {
        ((self.0 & !Place::MOVING) >> 4) as usize
    }
}

struct Walk<'a> {
    index: &'a SceneIndex,
    contexts: Vec<Context<'a>>,
    /// Bounds of the meshes' and the groups' trees entered so far.
    mesh_bounds: Vec<Option<Box3>>,
    group_bounds: Vec<Option<Box3>>,
    open: NearestFirst<Entry>,
    /// What lies in the small entry being gone through, which comes before anything in `open`.
    near: NearestFirst<Entry>,
    /// While one is gone through: the number of contexts before it.
    kept: Option<usize>,
    window: Rect,
    /// The children of the node visited last.
    projected: ProjectedBoxes,
    hierarchical: bool,
    definitive: bool,
    /// Blocks drawn from memory before the walk.
    drawn: HashSet<Block, BuildHasherDefault<BlockHasher>>,
    /// Blocks that show, if they are to be remembered.
    seen: Option<Vec<Block>>,
    counters: Counters,
}

#[inline(always)]
fn walk<S: Simd>(
    simd: S,
    index: &SceneIndex,
    view: &View,
    how: (Algorithm, BoxTest),
    target: &mut Target,
    memory: Option<&mut Memory>,
) -> Counters {
    let window = Rect {
        left: target.left,
        top: target.top,
        right: target.left + target.width,
        bottom: target.top + target.height,
    };
    let mut walk = Walk {
        index,
        contexts: Vec::with_capacity(256),
        mesh_bounds: vec![None; index.meshes.len()],
        group_bounds: vec![None; index.groups.len()],
        open: NearestFirst::new(),
        near: NearestFirst::new(),
        kept: None,
        window,
        projected: ProjectedBoxes::default(),
        hierarchical: how.0 == Algorithm::Hzb,
        definitive: how == (Algorithm::Hzb, BoxTest::Definitive),
        drawn: HashSet::default(),
        seen: None,
        counters: Counters::default(),
    };
    let root = index.scene().root;
    if let Some(memory) = &memory {
        if memory.starts_next() {
            walk.draw_remembered(simd, target, memory, ScreenFromObject::of_view(view));
        }
        walk.seen = memory.keeps_next().then(|| Vec::with_capacity(memory.seen.len() + 64));
    }
    walk.enter(simd, target, Content::Group(root), ScreenFromObject::of_view(view), 0);
    while let Some(entry) = walk.next() {
        if walk.hierarchical && target.hides(simd, rect_of(&entry), entry.depth) {
            walk.counters.nodes_culled += 1;
            continue;
        }
        if walk.definitive && walk.outline_is_hidden(simd, target, &entry) {
            walk.counters.nodes_culled += 1;
            continue;
        }
        walk.go_through_if_small(&entry);
        match entry.slot.child() {
            Child::Node(node) => {
                walk.visit_node(simd, target, entry.context, Place::new(entry.place.is_moving(), node));
            }
            Child::Leaf(leaf) => walk.visit_leaf(simd, target, entry.context, leaf),
        }
    }
    walk.counters.pixels_written = target.counters.pixels_written;
    if let Some(memory) = memory {
        memory.seen = walk.seen.take().unwrap_or_default();
        memory.choice.learn(&walk.counters);
    }
    walk.counters
}

/// Rectangles with a side below this, pixels, are left at the test of the rectangle.
const DEFINITIVE: u16 = 16;

/// Entries with both sides below this, pixels (up to one), are gone through at once.
const SMALL: u16 = 16;

#[inline(always)]
fn tree_of<'a>(context: &Context<'a>, moving: bool) -> &'a WideTree {
    match context.space {
        Space::Mesh { blocks, .. } => &blocks.tree,
        Space::Group(group) if moving => &group.moving,
        Space::Group(group) => &group.resting,
    }
}

/// To the screen from the space of the boxes of what is entered at `at`.
#[inline(always)]
fn screen_from_boxes(space: &Space, at: &ScreenFromObject) -> ScreenFromObject {
    match space {
        Space::Mesh { .. } => *at,
        Space::Group(group) => group.screen_from_trees(at),
    }
}

#[inline(always)]
fn rect_of(entry: &Entry) -> Rect {
    let r = &entry.rect;
    Rect {
        left: i32::from(r[0]),
        top: i32::from(r[1]),
        right: i32::from(r[2]) + 1,
        bottom: i32::from(r[3]) + 1,
    }
}

impl<'a> Walk<'a> {
    /// Takes what is to be visited next.
    #[inline(always)]
    fn next(&mut self) -> Option<Entry> {
        if let Some(entry) = self.near.pop() {
            return Some(entry);
        }
        if let Some(kept) = self.kept.take() {
            self.contexts.truncate(kept);
        }
        self.open.pop()
    }

    /// What lies in an entry of few pixels is gone through at once, nearest first, before anything else: its
    /// transforms and pixels then stay in the nearest cache, and are done with when it is.
    #[inline(always)]
    fn go_through_if_small(&mut self, entry: &Entry) {
        let r = &entry.rect;
        if self.kept.is_none() && (r[2] - r[0]).max(r[3] - r[1]) < SMALL {
            self.kept = Some(self.contexts.len());
        }
    }

    /// Opens the tree of `content` (seen through `at`) and visits its root.
    #[inline(always)]
    fn enter<S: Simd>(
        &mut self,
        simd: S,
        target: &Target,
        content: Content,
        at: ScreenFromObject,
        instance: u32,
    ) {
        let (space, bounds) = match content {
            Content::Mesh(mesh) => {
                let blocks = &self.index.meshes[mesh as usize].solid;
                (Space::Mesh { blocks, mesh }, &mut self.mesh_bounds[mesh as usize])
            }
            Content::Group(g) => {
                let group = &self.index.groups[g as usize];
                (Space::Group(group), &mut self.group_bounds[g as usize])
            }
            Content::Nothing => return,
        };
        let bounds = bounds.get_or_insert_with(|| match space {
            Space::Mesh { blocks, .. } => blocks.tree.bounds(),
            Space::Group(group) => group.bounds_of_trees(),
        });
        if bounds.is_empty() {
            return;
        }
        let reach = bounds.reach();
        let context = self.contexts.len() as u32;
        let boxes = BoxSet::new(&screen_from_boxes(&space, &at), reach);
        self.contexts.push(Context { space, at, boxes, instance });
        match space {
            Space::Mesh { .. } => self.visit_node(simd, target, context, Place::new(false, 0)),
            Space::Group(group) => {
                for (tree, moving) in [(&group.resting, false), (&group.moving, true)] {
                    if !tree.nodes.is_empty() {
                        self.visit_node(simd, target, context, Place::new(moving, 0));
                    }
                }
            }
        }
    }

    /// The definitive test of what the rectangle test did not hide.
    #[inline(always)]
    fn outline_is_hidden<S: Simd>(&self, simd: S, target: &mut Target, entry: &Entry) -> bool {
        let r = &entry.rect;
        if (r[2] - r[0]).min(r[3] - r[1]) < DEFINITIVE || entry.depth == f32::INFINITY {
            return false;
        }
        let c = &self.contexts[entry.context as usize];
        let node = &tree_of(c, entry.place.is_moving()).nodes[entry.place.node()];
        let bounds = node.bounds_of(entry.place.0 as usize % 16);
        let at = screen_from_boxes(&c.space, &c.at);
        target.hides_outline(simd, &at, [bounds.min, bounds.max], rect_of(entry), entry.depth)
    }

    #[inline(always)]
    fn visit_node<S: Simd>(&mut self, simd: S, target: &Target, context: u32, place: Place) {
        let c = &self.contexts[context as usize];
        let node = &tree_of(c, place.is_moving()).nodes[place.node()];
        let (window, boxes, projected) = (self.window, &c.boxes, &mut self.projected);
        simd.vectorize(
            #[inline(always)]
            || project_boxes(simd, boxes, &node.min, &node.max, window, projected),
        );
        let alive = projected.alive & (0xFFFFu32 >> (16 - node.used)) as u16;
        self.counters.nodes_visited += u64::from(node.used);
        self.counters.nodes_outside += u64::from(node.used - alive.count_ones());
        self.push_children(target, alive, (place, &node.child), context);
    }

    /// Opens the children in `alive` of the node projected last.
    #[inline(always)]
    fn push_children(
        &mut self,
        target: &Target,
        alive: u16,
        (place, child): (Place, &[Slot; 16]),
        context: u32,
    ) {
        let projected = &self.projected;
        let mut rest = alive;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize & 15;
            rest &= rest - 1;
            if child[lane] == Slot::EMPTY {
                continue;
            }
            let entry = Entry {
                slot: child[lane],
                context,
                place: place.lane(lane),
                rect: [
                    projected.left[lane] as u16,
                    projected.top[lane] as u16,
                    projected.right[lane] as u16,
                    projected.bottom[lane] as u16,
                ],
                depth: projected.depth[lane],
            };
            if self.hierarchical && target.one_sample_hides(entry.rect, entry.depth) {
                self.counters.nodes_culled += 1;
                continue;
            }
            let queue = if self.kept.is_some() { &mut self.near } else { &mut self.open };
            queue.push(entry, entry.depth.max(0.0));
        }
    }

    #[inline(always)]
    fn visit_leaf<S: Simd>(&mut self, simd: S, target: &mut Target, context: u32, leaf: u32) {
        let c = &self.contexts[context as usize];
        match c.space {
            Space::Group(group) => {
                let item = &group.items[leaf as usize];
                let at = c.at.after(&group.group_from_content[leaf as usize]);
                let instance = c.instance + item.first_instance;
                self.enter(simd, target, item.content, at, instance);
            }
            Space::Mesh { blocks, mesh } => {
                let this = Block { instance: c.instance, block: leaf };
                if !self.drawn.is_empty() && self.drawn.contains(&this) {
                    if let Some(seen) = &mut self.seen {
                        seen.push(this);
                    }
                    return;
                }
                let block = &blocks.blocks[leaf as usize];
                let scene = self.index.scene();
                let (at, instance) = (&c.at, c.instance);
                let drawing = Drawing { instance, at, hierarchical: self.hierarchical };
                let wrote = draw(simd, target, &drawing, scene, mesh, block, &mut self.counters);
                if let Some(seen) = &mut self.seen
                    && wrote
                {
                    seen.push(this);
                }
            }
        }
    }

    /// Draws what was visible last time, in that order, before anything is asked of the pyramid
    /// [Greene 1995, §3.3.3].
    #[inline(always)]
    fn draw_remembered<S: Simd>(
        &mut self,
        simd: S,
        target: &mut Target,
        memory: &Memory,
        root: ScreenFromObject,
    ) {
        // Blocks of an instance are not neighbours in depth order; its transform is composed once.
        let mut placed =
            HashMap::<u32, Option<(u32, ScreenFromObject)>, BuildHasherDefault<BlockHasher>>::default();
        for &this in &memory.seen {
            let found = placed
                .entry(this.instance)
                .or_insert_with(|| screen_from_instance(self.index, root, this.instance));
            let Some((mesh, at)) = *found else { continue };
            let scene = self.index.scene();
            let Some(block) = self.index.meshes[mesh as usize].solid.blocks.get(this.block as usize) else {
                continue;
            };
            let drawing = Drawing { instance: this.instance, at: &at, hierarchical: self.hierarchical };
            if draw(simd, target, &drawing, scene, mesh, block, &mut self.counters) {
                self.drawn.insert(this);
            }
        }
    }
}

/// Draws one block of triangles; returns whether a pixel was written.
#[inline(always)]
fn draw<S: Simd>(
    simd: S,
    target: &mut Target,
    drawing: &Drawing,
    scene: &Scene,
    mesh: u32,
    block: &TriangleBlock,
    counters: &mut Counters,
) -> bool {
    let mut is_hole = |lane: usize, x, y| {
        is_hole(scene, mesh, block.triangle[lane], &block.corners(lane), drawing.at, x, y)
    };
    // A function of its own: one copy of the code for each instruction set.
    let counts = simd.vectorize(
        #[inline(always)]
        || draw_block(simd, target, block, drawing, &mut is_hole),
    );
    counters.triangles_tested += u64::from(block.lanes.count_ones());
    counters.triangles_front_facing += u64::from(counts.front_facing);
    counters.triangles_drawn += u64::from(counts.drawn);
    counts.wrote
}

/// The mesh of an instance, and its transform with the very operations of the walk.
fn screen_from_instance(
    index: &SceneIndex,
    root: ScreenFromObject,
    instance: u32,
) -> Option<(u32, ScreenFromObject)> {
    let mut at = root;
    let mesh = index.descend(instance, |group_from_content| at = at.after(group_from_content))?;
    Some((mesh, at))
}

/// What a window showed last time.
#[derive(Debug, Default)]
pub(super) struct Memory {
    seen: Vec<Block>,
    /// Whether every frame is to start from the last one, wherever the choice would fall.
    pub always: bool,
    choice: Choice,
}

impl Memory {
    fn starts_next(&self) -> bool {
        self.always || self.choice.next_is_coherent()
    }

    fn keeps_next(&self) -> bool {
        self.always || self.choice.remembers()
    }
}

/// A block of triangles of one instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Block {
    instance: u32,
    block: u32,
}

/// Mixes two 32-bit numbers; the table only needs them spread.
#[derive(Default)]
struct BlockHasher(u64);

impl Hasher for BlockHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&b| self.write_u32(u32::from(b)));
    }

    fn write_u32(&mut self, n: u32) {
        self.0 = (self.0.rotate_left(26) ^ u64::from(n)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
}

/// Whether a masked triangle has a hole at an image pixel's centre.
#[inline(never)]
fn is_hole(
    scene: &Scene,
    mesh: u32,
    triangle: u32,
    corners: &[[f32; 3]; 3],
    at: &ScreenFromObject,
    x: i32,
    y: i32,
) -> bool {
    scene.is_hole(mesh, triangle, barycentric(corners, at, x, y))
}

/// Barycentric weights of the triangle's point behind an image pixel's centre, perspective included.
pub(super) fn barycentric(corners: &[[f32; 3]; 3], at: &ScreenFromObject, x: i32, y: i32) -> DVec3 {
    let v = corners.map(|c| at.point(c.map(f64::from))).map(|p| DVec3::new(p[0], p[1], p[2]));
    let pixel = DVec3::new(f64::from(x * 256 + 128), f64::from(y * 256 + 128), 1.0);
    let weights =
        DVec3::new(pixel.dot(v[1].cross(v[2])), pixel.dot(v[2].cross(v[0])), pixel.dot(v[0].cross(v[1])));
    let sum = weights.x + weights.y + weights.z;
    weights / sum
}
