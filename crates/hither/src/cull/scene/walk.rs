//! The nearest-first walk of a scene's nested trees that draws occluders and drops what they hide.

use super::{CullCounters, CullOptions, Culling, Judged, Reason};
use crate::cull::buffer::{Band, Drawn, Frame, Occluder, project};
use crate::index::{Child, GroupIndex, SceneIndex, Slot, WideTree};
use crate::raster::ScreenFromObject;
use crate::scene::Content;
use fearless_simd::Simd;
use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashSet};

/// A group entered with a transform.
struct Context<'a> {
    group: &'a GroupIndex,
    at: ScreenFromObject,
    /// Number of its first instance.
    first: u32,
}

/// A child of a group's tree that the view may show.
#[derive(Clone, Copy)]
struct Open {
    depth: f32,
    slot: Slot,
    context: u32,
    moving: bool,
    rect: [i32; 4],
    /// Whether it may reach beyond the picture to where a moving eye would see it.
    cut: bool,
}

impl Ord for Open {
    /// The nearest is the greatest; the rest only makes the order the same every time.
    fn cmp(&self, o: &Open) -> Ordering {
        let key = |e: &Open| (e.context, e.rect);
        self.depth.total_cmp(&o.depth).then_with(|| key(o).cmp(&key(self)))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, o: &Open) -> Option<Ordering> {
        Some(self.cmp(o))
    }
}

impl PartialEq for Open {
    fn eq(&self, o: &Open) -> bool {
        self.cmp(o) == Ordering::Equal
    }
}

impl Eq for Open {}

/// An instance that may be seen, as far as is known.
struct Seen {
    instance: u32,
    mesh: u32,
    at: ScreenFromObject,
    /// How many occluders had been drawn when it was judged.
    occluders: u64,
}

struct Walk<'a> {
    index: &'a SceneIndex,
    occluders: &'a [Occluder],
    frame: &'a Frame,
    options: &'a CullOptions,
    band: &'a mut Band,
    contexts: Vec<Context<'a>>,
    open: BinaryHeap<Open>,
    seen: Vec<Seen>,
    drawn: HashSet<u32>,
    hid: &'a mut Vec<(u32, u32)>,
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
    before: &[(u32, u32)],
    hid: &mut Vec<(u32, u32)>,
) -> Culling {
    let mut walk = Walk {
        index,
        occluders,
        frame,
        options,
        band,
        contexts: Vec::new(),
        open: BinaryHeap::new(),
        seen: Vec::new(),
        drawn: HashSet::new(),
        hid,
        counters: CullCounters::default(),
        judged: Vec::new(),
    };
    for &(instance, pixels) in before {
        if let Some((mesh, at)) = screen_from_instance(index, frame.screen_from_world, instance) {
            walk.draw(simd, instance, mesh, at, pixels);
        }
    }
    walk.enter(simd, index.scene().root, frame.screen_from_world, 0);
    while let Some(open) = walk.open.pop() {
        walk.counters.boxes_asked += 1;
        if !open.cut && walk.band.hides(simd, open.rect, open.depth) {
            walk.counters.boxes_hidden += 1;
            walk.judge(open.context, open.slot, open.moving, Reason::BoxHidden);
            continue;
        }
        match open.slot.child() {
            Child::Node(node) => walk.visit(simd, open.context, open.moving, node),
            Child::Leaf(item) => walk.visit_item(simd, &open, item),
        }
    }
    walk.finish(simd)
}

impl<'a> Walk<'a> {
    /// Opens a group's trees.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, simd: S, group: u32, at: ScreenFromObject, first: u32) {
        let group = &self.index.groups[group as usize];
        let context = self.contexts.len() as u32;
        self.contexts.push(Context { group, at, first });
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
        let view = self.frame.box_view(&c.at);
        let (min, max) = self.frame.widened(&node.min, &node.max, &c.at);
        let boxes = simd.vectorize(
            #[inline(always)]
            || project(simd, &view, &min, &max),
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
            self.open.push(Open {
                depth: boxes.depth[lane],
                slot: node.child[lane],
                context,
                moving,
                rect: [boxes.left[lane], boxes.top[lane], boxes.right[lane], boxes.bottom[lane]],
                cut: view.margin[0] > 0.0 && boxes.uncut >> lane & 1 == 0,
            });
        }
    }

    #[inline(always)]
    fn visit_item<S: Simd>(&mut self, simd: S, open: &Open, item: u32) {
        let c = &self.contexts[open.context as usize];
        let item = &c.group.items[item as usize];
        let (at, instance) = (c.at.after(&item.group_from_content), c.first + item.first_instance);
        let mesh = match item.content {
            Content::Group(group) => return self.enter(simd, group, at, instance),
            Content::Mesh(mesh) => mesh,
            Content::Nothing => return,
        };
        match self.mesh_shows(simd, mesh, &at) {
            Shows::No(reason) => self.judge_one(instance, reason),
            Shows::Yes(reason) => {
                self.judge_one(instance, reason);
                let occluders = self.counters.occluders;
                self.seen.push(Seen { instance, mesh, at, occluders });
                let [left, top, right, bottom] = open.rect;
                let pixels = ((right - left + 1) * (bottom - top + 1)) as u32;
                if pixels >= self.options.least_occluder_px {
                    self.draw(simd, instance, mesh, at, pixels);
                }
            }
        }
    }

    /// Draws an instance's opaque surface, once.
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, instance: u32, mesh: u32, at: ScreenFromObject, pixels: u32) {
        let occluder = &self.occluders[mesh as usize];
        if occluder.is_empty() || !self.drawn.insert(instance) {
            return;
        }
        let mut standing = self.frame.standing_at(occluder, at);
        standing.least_px = standing.least_px.max(self.options.least_piece_px as i32);
        standing.px_a_face = self.options.least_px_a_face as i32;
        let mut drawn = Drawn::default();
        self.band.draw(simd, &standing, &mut drawn);
        if drawn.patches > 0 {
            self.hid.push((instance, pixels));
        }
        self.counters.occluders += 1;
        self.counters.occluder_patches += drawn.patches;
        self.counters.occluder_faces += drawn.faces;
    }

    /// Whether one of the boxes in a mesh's trees shows, nearest first, down to its blocks of triangles, as long
    /// as there are not too many to ask about.
    #[inline(always)]
    fn mesh_shows<S: Simd>(&mut self, simd: S, mesh: u32, at: &ScreenFromObject) -> Shows {
        let mesh = &self.index.meshes[mesh as usize];
        let view = self.frame.box_view(at);
        let mut left = self.options.boxes_an_instance;
        let mut inside = false;
        for tree in [&mesh.solid.tree, &mesh.blended.tree] {
            if tree.nodes.is_empty() {
                continue;
            }
            let mut stack = vec![0u32];
            while let Some(node) = stack.pop() {
                let node = &tree.nodes[node as usize];
                let (min, max) = self.frame.widened(&node.min, &node.max, at);
                let boxes = simd.vectorize(
                    #[inline(always)]
                    || project(simd, &view, &min, &max),
                );
                self.counters.boxes_projected += u64::from(node.used);
                let mut lanes = [0u8; 16];
                let mut count = 0;
                for lane in 0..node.used as usize {
                    if boxes.inside >> lane & 1 == 0 || node.child[lane] == Slot::EMPTY {
                        continue;
                    }
                    inside = true;
                    if boxes.depth[lane] == f32::INFINITY {
                        return Shows::Yes(Reason::ReachesNearPlane);
                    }
                    if view.margin[0] > 0.0 && boxes.uncut >> lane & 1 == 0 {
                        return Shows::Yes(Reason::Shows);
                    }
                    self.counters.boxes_asked += 1;
                    let rect = [boxes.left[lane], boxes.top[lane], boxes.right[lane], boxes.bottom[lane]];
                    if self.band.hides(simd, rect, boxes.depth[lane]) {
                        self.counters.boxes_hidden += 1;
                        continue;
                    }
                    // The farthest first: the last is popped first.
                    let mut at = count;
                    lanes[count] = lane as u8;
                    count += 1;
                    while at > 0 && boxes.depth[usize::from(lanes[at - 1])] > boxes.depth[lane] {
                        lanes.swap(at, at - 1);
                        at -= 1;
                    }
                }
                for &lane in &lanes[..count] {
                    match node.child[usize::from(lane)].child() {
                        Child::Leaf(_) => return Shows::Yes(Reason::Shows),
                        Child::Node(node) => stack.push(node),
                    }
                }
                left = left.saturating_sub(node.used);
                if left == 0 && !stack.is_empty() {
                    return Shows::Yes(Reason::Shows);
                }
            }
        }
        Shows::No(if inside { Reason::PartsHidden } else { Reason::OutsideView })
    }

    /// Asks again about everything, and puts the answer together.
    #[inline(always)]
    fn finish<S: Simd>(mut self, simd: S) -> Culling {
        let seen = std::mem::take(&mut self.seen);
        let mut visible = Vec::with_capacity(seen.len());
        for one in &seen {
            // Nothing was drawn since.
            if one.occluders == self.counters.occluders {
                visible.push(one.instance);
                continue;
            }
            match self.mesh_shows(simd, one.mesh, &one.at) {
                Shows::Yes(_) => visible.push(one.instance),
                Shows::No(_) => {
                    self.counters.second_thoughts += 1;
                    if self.options.reasons {
                        self.judged.retain(|j| j.instances != (one.instance..one.instance + 1));
                        self.judge_one(one.instance, Reason::HiddenAfterAll);
                    }
                }
            }
        }
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
    let (mut at, mut rest) = (root, instance);
    let mut group = index.scene().root;
    loop {
        let items = &index.groups[group as usize].items;
        let item = items[..items.partition_point(|i| i.first_instance <= rest)].last()?;
        at = at.after(&item.group_from_content);
        rest -= item.first_instance;
        match item.content {
            Content::Mesh(mesh) => return (rest == 0).then_some((mesh, at)),
            Content::Group(g) => group = g,
            Content::Nothing => return None,
        }
    }
}
