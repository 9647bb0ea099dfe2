//! The nearest-first walk of a scene's nested trees that draws occluders and drops what they hide.

use super::{Before, CullCounters, CullOptions, Culling, Hid, Judged, Reason};
use crate::cull::buffer::{Band, BoxView, Drawn, Frame, Occluder, project};
use crate::index::{Child, GroupIndex, SceneIndex, Slot, WideNode, WideTree};
use crate::raster::ScreenFromObject;
use crate::scene::Content;
use fearless_simd::Simd;
use std::collections::{BinaryHeap, HashMap, HashSet};

/// A mesh's box of so many pixels is worth one more question about the boxes inside.
const PX_A_BOX: u32 = 4;

/// An instance whose box covers no more pixels is taken for what its box is.
const PX_OF_A_SPECK: u32 = 16;

/// A group entered with a transform.
struct Context<'a> {
    group: &'a GroupIndex,
    at: ScreenFromObject,
    /// The same, ready for boxes.
    boxes: BoxView,
    /// Number of its first instance.
    first: u32,
}

/// A child of a group's tree that the view may show.
#[derive(Clone, Copy)]
struct Open {
    /// No point of it is nearer, and none is farther.
    nearest: f32,
    farthest: f32,
    slot: Slot,
    context: u32,
    moving: bool,
    rect: [i32; 4],
    /// Whether no border of the picture cuts it, for any eye that may come.
    whole: bool,
}

impl Open {
    /// Pixels in the rectangle around it; as many as can be, where it may reach the near plane.
    #[inline(always)]
    fn pixels(&self) -> u32 {
        let [left, top, right, bottom] = self.rect;
        if self.nearest < f32::INFINITY { ((right - left + 1) * (bottom - top + 1)) as u32 } else { u32::MAX }
    }
}

/// What is to be looked at, the nearest first; of what is equally near, what was found first.
#[derive(Default)]
struct Queue {
    /// The bits of a depth above the complement of a place in `found`: small, as they are moved about a lot.
    order: BinaryHeap<u64>,
    found: Vec<Open>,
}

impl Queue {
    #[inline(always)]
    fn push(&mut self, open: Open) {
        // Depths that are 0 or more are ordered as their bits are.
        let key = u64::from(open.nearest.to_bits()) << 32 | u64::from(!(self.found.len() as u32));
        self.order.push(key);
        self.found.push(open);
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Open> {
        let place = !(self.order.pop()? as u32);
        Some(self.found[place as usize])
    }
}

/// An instance that may be seen, as far as is known before everything is drawn.
struct Seen {
    instance: u32,
    open: Open,
    /// How many occluders had been drawn when it was judged.
    occluders: u64,
    /// Its place among those judged, if they are noted.
    judged: usize,
}

/// What the walk's options come to in pixels of the buffer.
#[derive(Clone, Copy)]
struct Thresholds {
    /// An instance whose box covers fewer is not drawn, and boxes that cover fewer hold none that is.
    occluder_px: u32,
    piece_px: i32,
    px_a_face: i32,
}

impl Thresholds {
    fn new(options: &CullOptions) -> Thresholds {
        let n = options.coarseness.max(1);
        let length = |px: u32| px.div_ceil(n).min(1 << 20);
        let area = |px: u32| px.div_ceil(n.saturating_mul(n));
        Thresholds {
            occluder_px: area(options.least_occluder_px),
            piece_px: length(options.least_piece_px) as i32,
            px_a_face: area(options.least_px_a_face).min(1 << 20) as i32,
        }
    }
}

struct Walk<'a> {
    index: &'a SceneIndex,
    occluders: &'a [Occluder],
    frame: &'a Frame,
    options: &'a CullOptions,
    least: Thresholds,
    band: &'a mut Band,
    contexts: Vec<Context<'a>>,
    /// What may hold an occluder.
    queue: Queue,
    /// What is too small for that, in no order. Looked at when everything is drawn.
    aside: Vec<Open>,
    everything_is_drawn: bool,
    seen: Vec<Seen>,
    /// Instances that may be seen, below the complement of the bits of their depth.
    visible: Vec<u64>,
    /// Nodes of a mesh's tree to look at.
    stack: Vec<u32>,
    /// Occluders drawn before the walk.
    drawn: HashSet<u32>,
    idle: &'a HashMap<u32, u32>,
    hid: &'a mut Vec<Hid>,
    counters: CullCounters,
    judged: Vec<Judged>,
}

#[expect(clippy::too_many_arguments, reason = "the parts of one view's state, borrowed apart")]
#[inline(always)]
pub(super) fn cull<S: Simd>(
    simd: S,
    index: &SceneIndex,
    occluders: &[Occluder],
    frame: &Frame,
    options: &CullOptions,
    band: &mut Band,
    before: &Before,
    hid: &mut Vec<Hid>,
) -> Culling {
    let mut walk = Walk {
        index,
        occluders,
        frame,
        options,
        least: Thresholds::new(options),
        band,
        contexts: Vec::new(),
        queue: Queue::default(),
        aside: Vec::new(),
        everything_is_drawn: false,
        seen: Vec::new(),
        visible: Vec::new(),
        stack: Vec::new(),
        drawn: HashSet::new(),
        idle: before.idle,
        hid,
        counters: CullCounters::default(),
        judged: Vec::new(),
    };
    for &Hid { instance, .. } in before.hid {
        if let Some((mesh, at)) = screen_from_instance(index, frame.screen_from_world, instance) {
            walk.draw(simd, instance, mesh, at);
            walk.drawn.insert(instance);
        }
    }
    walk.enter(simd, index.scene().root, frame.screen_from_world, 0);
    while let Some(open) = walk.queue.pop() {
        walk.look_at(simd, &open);
    }
    walk.everything_is_drawn = true;
    walk.ask_again(simd);
    let small = std::mem::take(&mut walk.aside);
    for open in &small {
        walk.look_at(simd, open);
        // What is inside it.
        while let Some(open) = walk.aside.pop() {
            walk.look_at(simd, &open);
        }
    }
    walk.finish()
}

impl<'a> Walk<'a> {
    /// Drops what is hidden, and opens what is not.
    #[inline(always)]
    fn look_at<S: Simd>(&mut self, simd: S, open: &Open) {
        self.counters.boxes_asked += 1;
        if self.is_hidden(simd, open) {
            self.counters.boxes_hidden += 1;
            self.credit(open.rect);
            self.judge(open.context, open.slot, open.moving, Reason::BoxHidden);
            return;
        }
        match open.slot.child() {
            Child::Node(node) => self.visit(simd, open.context, open.moving, node),
            Child::Leaf(item) => self.visit_item(simd, open, item),
        }
    }

    /// Opens a group's trees.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, simd: S, group: u32, at: ScreenFromObject, first: u32) {
        let group = &self.index.groups[group as usize];
        let context = self.contexts.len() as u32;
        let boxes = self.frame.box_view(&at);
        self.contexts.push(Context { group, at, boxes, first });
        for (tree, moving) in [(&group.resting, false), (&group.moving, true)] {
            if !tree.nodes.is_empty() {
                self.visit(simd, context, moving, 0);
            }
        }
    }

    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, context: u32, moving: bool, node: u32) {
        let c = &self.contexts[context as usize];
        let tree: &'a WideTree = if moving { &c.group.moving } else { &c.group.resting };
        let node = &tree.nodes[node as usize];
        let view = c.boxes;
        let wide;
        let (min, max) = match self.frame.moves() {
            false => (&node.min, &node.max),
            true => {
                wide = self.frame.widened(&node.min, &node.max, &c.at);
                (&wide.0, &wide.1)
            }
        };
        let boxes = simd.vectorize(
            #[inline(always)]
            || project(simd, &view, min, max),
        );
        self.counters.boxes_projected += u64::from(node.used);
        for lane in 0..node.used as usize {
            if node.child[lane] == Slot::EMPTY {
                continue;
            }
            if boxes.inside >> lane & 1 == 0 {
                self.judge(context, node.child[lane], moving, Reason::OutsideView);
                continue;
            }
            let open = Open {
                nearest: boxes.depth[lane],
                farthest: boxes.farthest[lane],
                slot: node.child[lane],
                context,
                moving,
                rect: [boxes.left[lane], boxes.top[lane], boxes.right[lane], boxes.bottom[lane]],
                whole: boxes.uncut >> lane & 1 == 1,
            };
            if self.everything_is_drawn || open.pixels() < self.least.occluder_px {
                self.aside.push(open);
            } else {
                self.queue.push(open);
            }
        }
    }

    #[inline(always)]
    fn visit_item<S: Simd>(&mut self, simd: S, open: &Open, item: u32) {
        let c = &self.contexts[open.context as usize];
        let (item, group_at) = (&c.group.items[item as usize], c.at);
        let pixels = open.pixels();
        let instance = c.first + item.first_instance;
        if let Content::Mesh(mesh) = item.content
            && open.nearest < f32::INFINITY
            && (pixels <= PX_OF_A_SPECK || open.whole && self.band.is_behind(open.rect, open.farthest))
        {
            // Nothing is before it yet: its smaller boxes would show like its own.
            self.take_for_visible(open, instance, Reason::Shows);
            if self.draws(pixels) && pixels > PX_OF_A_SPECK {
                self.draw(simd, instance, mesh, group_at.after(&item.group_from_content));
            }
            return;
        }
        let at = group_at.after(&item.group_from_content);
        let mesh = match item.content {
            Content::Group(group) => return self.enter(simd, group, at, instance),
            Content::Mesh(mesh) => mesh,
            Content::Nothing => return,
        };
        match self.mesh_shows(simd, mesh, &at, pixels) {
            Shows::No(reason) => self.judge_one(instance, reason),
            Shows::Yes(reason) => {
                self.take_for_visible(open, instance, reason);
                if self.draws(pixels) {
                    self.draw(simd, instance, mesh, at);
                }
            }
        }
    }

    /// Whether an instance with a box of so many pixels is to be drawn.
    #[inline(always)]
    fn draws(&self, pixels: u32) -> bool {
        pixels >= self.least.occluder_px && !self.everything_is_drawn
    }

    /// Whether what was drawn hides a box; never if it may be seen by an eye that moves, beyond the picture.
    #[inline(always)]
    fn is_hidden<S: Simd>(&self, simd: S, open: &Open) -> bool {
        (open.whole || self.frame.margin().is_none()) && self.band.hides(simd, open.rect, open.nearest)
    }

    /// Counts a hidden box for the occluder that hides it.
    #[inline(always)]
    fn credit(&mut self, rect: [i32; 4]) {
        let who = self.band.who_hides(rect) as usize;
        if let Some(hid) = self.hid.get_mut(who) {
            hid.boxes += 1;
        }
    }

    #[inline(always)]
    fn take_for_visible(&mut self, open: &Open, instance: u32, reason: Reason) {
        self.judge_one(instance, reason);
        if self.everything_is_drawn {
            self.visible.push(key(open.nearest, instance));
            return;
        }
        let (occluders, judged) = (self.counters.occluders, self.judged.len());
        self.seen.push(Seen { instance, open: *open, occluders, judged });
    }

    /// Draws an instance's opaque surface.
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, instance: u32, mesh: u32, at: ScreenFromObject) {
        let occluder = &self.occluders[mesh as usize];
        if occluder.is_empty() || self.drawn.contains(&instance) {
            return;
        }
        if !self.idle.is_empty() && self.idle.contains_key(&instance) {
            self.counters.occluders_idle += 1;
            return;
        }
        self.band.drawing(self.hid.len() as u32);
        let mut standing = self.frame.standing_at(occluder, at);
        standing.least_px = standing.least_px.max(self.least.piece_px);
        standing.px_a_face = self.least.px_a_face;
        let mut drawn = Drawn::default();
        self.band.draw(simd, &standing, &mut drawn);
        if drawn.patches > 0 {
            self.hid.push(Hid { instance, boxes: 0, faces: drawn.faces as u32 });
        }
        self.counters.occluders += 1;
        self.counters.occluder_patches += drawn.patches;
        self.counters.occluder_faces += drawn.faces;
    }

    /// Whether one of the boxes in a mesh's trees shows, nearest first, down to its blocks of triangles, as long
    /// as there are not too many to ask about. `pixels` are those of the box around it.
    #[inline(always)]
    fn mesh_shows<S: Simd>(&mut self, simd: S, mesh: u32, at: &ScreenFromObject, pixels: u32) -> Shows {
        let mesh = &self.index.meshes[mesh as usize];
        let view = self.frame.box_view(at);
        // Finer than a few pixels, boxes tell little that the whole's does not.
        let mut left = self.options.boxes_an_instance.min(pixels / PX_A_BOX);
        let mut inside = false;
        for tree in [&mesh.solid.tree, &mesh.blended.tree] {
            if tree.nodes.is_empty() {
                continue;
            }
            self.stack.clear();
            self.stack.push(0);
            while let Some(node) = self.stack.pop() {
                match self.node_shows(simd, &tree.nodes[node as usize], &view, at, &mut inside) {
                    Some(reason) => return Shows::Yes(reason),
                    None => left = left.saturating_sub(tree.nodes[node as usize].used),
                }
                if left == 0 && !self.stack.is_empty() {
                    return Shows::Yes(Reason::Shows);
                }
            }
        }
        Shows::No(if inside { Reason::PartsHidden } else { Reason::OutsideView })
    }

    /// Why a node of a mesh's tree shows for certain, as far as boxes can say; its children that may show, but have
    /// children themselves, go onto the stack, the nearest last.
    #[inline(always)]
    fn node_shows<S: Simd>(
        &mut self,
        simd: S,
        node: &WideNode,
        view: &BoxView,
        at: &ScreenFromObject,
        inside: &mut bool,
    ) -> Option<Reason> {
        let wide;
        let (min, max) = match self.frame.moves() {
            false => (&node.min, &node.max),
            true => {
                wide = self.frame.widened(&node.min, &node.max, at);
                (&wide.0, &wide.1)
            }
        };
        let boxes = simd.vectorize(
            #[inline(always)]
            || project(simd, view, min, max),
        );
        self.counters.boxes_projected += u64::from(node.used);
        let first = self.stack.len();
        let mut depths = [0.0; 16];
        let mut rest = u32::from(boxes.inside) & (0xFFFF >> (16 - node.used));
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize & 15;
            rest &= rest - 1;
            if node.child[lane] == Slot::EMPTY {
                continue;
            }
            *inside = true;
            if boxes.depth[lane] == f32::INFINITY {
                return Some(Reason::ReachesNearPlane);
            }
            if view.margin[0] > 0.0 && boxes.uncut >> lane & 1 == 0 {
                return Some(Reason::Shows);
            }
            self.counters.boxes_asked += 1;
            let rect = [boxes.left[lane], boxes.top[lane], boxes.right[lane], boxes.bottom[lane]];
            if self.band.hides(simd, rect, boxes.depth[lane]) {
                self.counters.boxes_hidden += 1;
                self.credit(rect);
                continue;
            }
            let Child::Node(child) = node.child[lane].child() else { return Some(Reason::Shows) };
            let mut to = self.stack.len();
            self.stack.push(child);
            depths[to - first] = boxes.depth[lane];
            while to > first && depths[to - first - 1] > depths[to - first] {
                self.stack.swap(to, to - 1);
                depths.swap(to - first, to - first - 1);
                to -= 1;
            }
        }
        None
    }

    /// Asks again about the boxes of what was taken for visible before everything was drawn.
    #[inline(always)]
    fn ask_again<S: Simd>(&mut self, simd: S) {
        for one in std::mem::take(&mut self.seen) {
            let anew = one.occluders != self.counters.occluders;
            if !(anew && self.is_hidden(simd, &one.open)) {
                self.visible.push(key(one.open.nearest, one.instance));
                continue;
            }
            self.counters.second_thoughts += 1;
            self.credit(one.open.rect);
            if self.options.reasons {
                self.judged[one.judged - 1].reason = Reason::HiddenAfterAll;
            }
        }
    }

    /// Puts the answer together.
    fn finish(mut self) -> Culling {
        self.visible.sort_unstable();
        let visible = self.visible.iter().map(|key| *key as u32).collect();
        Culling { visible, judged: self.judged, counters: self.counters }
    }

    fn judge_one(&mut self, instance: u32, reason: Reason) {
        if self.options.reasons {
            self.judged.push(Judged { instances: instance..instance + 1, reason });
        }
    }

    /// Notes the reason for everything below a slot.
    fn judge(&mut self, context: u32, slot: Slot, moving: bool, reason: Reason) {
        if !self.options.reasons {
            return;
        }
        let c = &self.contexts[context as usize];
        let tree = if moving { &c.group.moving } else { &c.group.resting };
        let mut stack = vec![slot];
        while let Some(slot) = stack.pop() {
            match slot.child() {
                Child::Node(node) => {
                    let node = &tree.nodes[node as usize];
                    stack.extend(node.child[..node.used as usize].iter().filter(|s| **s != Slot::EMPTY));
                }
                Child::Leaf(item) => {
                    let item = &c.group.items[item as usize];
                    let first = c.first + item.first_instance;
                    let count = match item.content {
                        Content::Group(g) => instances_of(&self.index.groups[g as usize], self.index),
                        _ => 1,
                    };
                    self.judged.push(Judged { instances: first..first + count, reason });
                }
            }
        }
    }
}

/// Sorts instances: the nearest is the smallest; of what is equally near, that with the smaller number.
#[inline(always)]
fn key(nearest: f32, instance: u32) -> u64 {
    // Depths that are 0 or more are ordered as their bits are.
    u64::from(!nearest.to_bits()) << 32 | u64::from(instance)
}

enum Shows {
    Yes(Reason),
    No(Reason),
}

/// How many instances a group expands to.
fn instances_of(group: &GroupIndex, index: &SceneIndex) -> u32 {
    let Some(last) = group.items.last() else { return 0 };
    last.first_instance
        + match last.content {
            Content::Group(g) => instances_of(&index.groups[g as usize], index),
            _ => 1,
        }
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
