//! The nearest-first walk of a scene's nested trees that draws occluders and drops what they hide.

use super::{Before, CullCounters, CullOptions, Culling, Hid, Judged, Reason};
use crate::cull::buffer::{Band, BoxView, BoxesOnScreen, Drawn, Frame, Occluder, project_lanes};
use crate::cull::queue::NearestFirst;
use crate::index::{Child, GroupIndex, Item, SceneIndex, Slot, WideNode};
use crate::raster::ScreenFromObject;
use crate::scene::Content;
use fearless_simd::{Simd, f32x16, i32x16, prelude::*};
use std::collections::{HashMap, HashSet};
use std::ops::Range;

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

/// A node of a group's trees.
#[derive(Clone, Copy)]
struct Place {
    context: u32,
    moving: bool,
    node: u32,
}

/// A child of a node that the view may show.
#[derive(Clone, Copy)]
struct Open {
    parent: Place,
    slot: Slot,
    /// No point of it is nearer, and none is farther.
    nearest: f32,
    farthest: f32,
    rect: [i32; 4],
    /// Whether no border of the picture cuts it, for any eye that may come.
    whole: bool,
}

impl Open {
    #[inline(always)]
    fn new(parent: Place, slot: Slot, boxes: &BoxesOnScreen, lane: usize) -> Open {
        Open {
            parent,
            slot,
            nearest: boxes.depth[lane],
            farthest: boxes.farthest[lane],
            rect: [boxes.left[lane], boxes.top[lane], boxes.right[lane], boxes.bottom[lane]],
            whole: boxes.uncut >> lane & 1 == 1,
        }
    }

    /// Pixels in the rectangle around it; as many as can be, where it may reach the near plane.
    #[inline(always)]
    fn pixels(&self) -> u32 {
        let [left, top, right, bottom] = self.rect;
        if self.nearest < f32::INFINITY { ((right - left + 1) * (bottom - top + 1)) as u32 } else { u32::MAX }
    }
}

/// Children of a node that are too small to hold an occluder.
struct Small {
    parent: Place,
    boxes: BoxesOnScreen,
    lanes: u16,
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

/// Pixels of a picture for which [`CullOptions::least_px_a_face`] is said.
const FULL_SIZE: f64 = 1920.0 * 1080.0;

/// What the walk's options come to in pixels of the buffer.
#[derive(Clone, Copy)]
struct Thresholds {
    /// An instance whose box covers fewer is not drawn, and boxes that cover fewer hold none that is.
    occluder_px: u32,
    piece_px: i32,
    px_a_face: i32,
}

impl Thresholds {
    fn new(options: &CullOptions, frame: &Frame) -> Thresholds {
        let n = frame.coarseness;
        let pixels = f64::from(frame.view.width) * f64::from(frame.view.height) * f64::from(n).powi(2);
        // What a piece hides is a share of the picture, and what it costs is its faces.
        let share = (pixels / FULL_SIZE).min(1.0);
        // Of a few coarse pixels, those at both ends are covered only in part, and what is thinner may touch as many.
        let length = |px: u32| (px.div_ceil(n) + u32::from(n > 1)).min(1 << 20);
        let area = |px: u32| px.div_ceil(n.saturating_mul(n));
        Thresholds {
            occluder_px: area(options.least_occluder_px),
            piece_px: length(options.least_piece_px) as i32,
            px_a_face: area((f64::from(options.least_px_a_face) * share).ceil() as u32).min(1 << 20) as i32,
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
    queue: NearestFirst<Open>,
    /// What is too small for that, in no order. Looked at when everything is drawn.
    aside: Vec<Small>,
    /// Nodes whose children are to be looked at before anything else, the last first.
    entered: Vec<Place>,
    /// Where the boxes of such a node are.
    boxes: BoxesOnScreen,
    /// The same of the nodes in `parts`.
    part_boxes: Vec<BoxesOnScreen>,
    everything_is_drawn: bool,
    seen: Vec<Seen>,
    /// Instances that may be seen, below the complement of the bits of their depth.
    visible: Vec<u64>,
    /// Nodes of a mesh's tree being looked at, each below the one before it.
    parts: Vec<Part>,
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
        least: Thresholds::new(options, frame),
        band,
        contexts: Vec::new(),
        queue: NearestFirst::new(),
        aside: Vec::new(),
        entered: Vec::new(),
        boxes: BoxesOnScreen::NONE,
        part_boxes: Vec::new(),
        everything_is_drawn: false,
        seen: Vec::new(),
        visible: Vec::new(),
        parts: Vec::new(),
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
    walk.enter(index.scene().root, frame.screen_from_world, 0);
    loop {
        walk.visit_entered(simd);
        let Some(open) = walk.queue.pop() else { break };
        walk.look_at(simd, &open);
    }
    walk.everything_is_drawn = true;
    walk.ask_again(simd);
    for small in std::mem::take(&mut walk.aside) {
        walk.boxes = small.boxes;
        walk.look_at_lanes(simd, small.parent, small.lanes);
        walk.visit_entered(simd);
    }
    walk.finish()
}

impl<'a> Walk<'a> {
    /// Drops what is hidden, and opens what is not.
    #[inline(always)]
    fn look_at<S: Simd>(&mut self, simd: S, open: &Open) {
        if self.drops(simd, open) {
            return;
        }
        match open.slot.child() {
            Child::Node(node) => self.entered.push(Place { node, ..open.parent }),
            Child::Leaf(at) => {
                let item = self.contexts[open.parent.context as usize].group.items[at as usize];
                self.visit_item(simd, open, at, item, self.is_speck(open) || self.is_behind(open));
            }
        }
    }

    /// As [`Walk::look_at`] for several children of a node, whose boxes were just projected.
    #[inline(always)]
    fn look_at_lanes<S: Simd>(&mut self, simd: S, parent: Place, lanes: u16) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (node, group) = (self.node(parent), self.contexts[parent.context as usize].group);
                // Leaves that are not hidden; of these, those that show as a whole.
                let (mut leaves, mut wholes) = (0u16, 0u16);
                for lane in bits(lanes) {
                    let slot = node.child[lane];
                    if slot == Slot::EMPTY {
                        continue;
                    }
                    let open = Open::new(parent, slot, &self.boxes, lane);
                    // What nothing is before is not hidden.
                    let behind = matches!(slot.child(), Child::Leaf(_)) && self.is_behind(&open);
                    if behind {
                        self.counters.boxes_asked += 1;
                    } else if self.drops(simd, &open) {
                        continue;
                    }
                    match slot.child() {
                        Child::Node(node) => self.entered.push(Place { node, ..parent }),
                        Child::Leaf(_) => {
                            leaves |= 1 << lane;
                            wholes |= u16::from(behind || self.is_speck(&open)) << lane;
                        }
                    }
                }
                let items = self.fetch(group, node, leaves, wholes);
                for lane in bits(leaves) {
                    let Child::Leaf(at) = node.child[lane].child() else { continue };
                    let open = Open::new(parent, node.child[lane], &self.boxes, lane);
                    self.visit_item(simd, &open, at, items[lane], wholes >> lane & 1 == 1);
                }
            },
        );
    }

    /// The items of several lanes of a node. Has what is needed of them, and lies anywhere, read from memory at the
    /// same time, where one after the other would be waited for.
    #[inline(always)]
    fn fetch(&self, group: &GroupIndex, node: &WideNode, leaves: u16, wholes: u16) -> [Item; 16] {
        let mut items = [Item { content: Content::Nothing, first_instance: 0, node: 0 }; 16];
        let mut read = 0.0;
        for lane in bits(leaves) {
            if let Child::Leaf(at) = node.child[lane].child() {
                items[lane] = group.items[at as usize];
            }
        }
        for lane in bits(leaves & !wholes) {
            let (Child::Leaf(at), Content::Mesh(mesh)) = (node.child[lane].child(), items[lane].content)
            else {
                continue;
            };
            let place = &group.group_from_content[at as usize];
            read += (place.matrix3.x_axis.x + place.translation.z) as f32;
            if let Some(root) = self.index.meshes[mesh as usize].solid.tree.nodes.first() {
                let WideNode { min: [a, b, c], max: [d, e, f], .. } = root;
                read += (a[0] + b[0]) + (c[0] + d[0]) + (e[0] + f[0]) + root.used as f32;
            }
        }
        // Nobody wants the sum: what it read is near when it is needed.
        std::hint::black_box(read);
        items
    }

    /// Asks about a box; whether it is hidden.
    #[inline(always)]
    fn drops<S: Simd>(&mut self, simd: S, open: &Open) -> bool {
        self.counters.boxes_asked += 1;
        let hidden = self.is_hidden(simd, open);
        if hidden {
            self.counters.boxes_hidden += 1;
            self.credit(open.rect);
            self.judge(open.parent, open.slot, Reason::BoxHidden);
        }
        hidden
    }

    /// Whether an instance's box is so small that the smaller ones in it are not asked about.
    #[inline(always)]
    fn is_speck(&self, open: &Open) -> bool {
        open.pixels() <= PX_OF_A_SPECK
    }

    /// Whether nothing is before an instance's box yet, which is no speck: the smaller ones in it would show as it does.
    #[inline(always)]
    fn is_behind(&self, open: &Open) -> bool {
        open.whole && !self.is_speck(open) && self.band.is_behind(open.rect, open.farthest)
    }

    /// Opens a group's trees.
    #[inline(always)]
    fn enter(&mut self, group: u32, at: ScreenFromObject, first: u32) {
        let group = &self.index.groups[group as usize];
        let context = self.contexts.len() as u32;
        let boxes = self.frame.box_view(&group.screen_from_trees(&at));
        self.contexts.push(Context { group, at, boxes, first });
        for (tree, moving) in [(&group.moving, true), (&group.resting, false)] {
            if !tree.nodes.is_empty() {
                self.entered.push(Place { context, moving, node: 0 });
            }
        }
    }

    #[inline(always)]
    fn node(&self, place: Place) -> &'a WideNode {
        let group: &'a GroupIndex = self.contexts[place.context as usize].group;
        let tree = if place.moving { &group.moving } else { &group.resting };
        &tree.nodes[place.node as usize]
    }

    #[inline(always)]
    fn visit_entered<S: Simd>(&mut self, simd: S) {
        while let Some(place) = self.entered.pop() {
            self.visit(simd, place);
        }
    }

    /// Finds where the children of a node are, and looks at them: at once if everything is drawn, else later.
    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, place: Place) {
        let node = self.node(place);
        let c = &self.contexts[place.context as usize];
        let moved = widened(self.frame, node, &c.at);
        let sides = moved.as_ref().map_or([&node.min, &node.max], |[min, max]| [min, max]);
        project(simd, &c.boxes, sides, 0..node.used, &mut self.boxes);
        self.counters.boxes_projected += u64::from(node.used);
        let inside = self.boxes.inside;
        if self.options.reasons {
            let outside = |lane: &usize| inside >> lane & 1 == 0 && node.child[*lane] != Slot::EMPTY;
            for lane in (0..node.used as usize).filter(outside) {
                self.judge(place, node.child[lane], Reason::OutsideView);
            }
        }
        if self.everything_is_drawn {
            return self.look_at_lanes(simd, place, inside);
        }
        let lanes = inside & smaller(simd, &self.boxes, self.least.occluder_px);
        if lanes != 0 {
            self.aside.push(Small { parent: place, boxes: self.boxes, lanes });
        }
        for lane in bits(inside & !lanes) {
            if node.child[lane] != Slot::EMPTY {
                let open = Open::new(place, node.child[lane], &self.boxes, lane);
                self.queue.push(open, open.nearest);
            }
        }
    }

    /// Opens an item, `number` of its group, that is not hidden.
    #[inline(always)]
    fn visit_item<S: Simd>(&mut self, simd: S, open: &Open, number: u32, item: Item, as_a_whole: bool) {
        let c = &self.contexts[open.parent.context as usize];
        let group_from_content = &c.group.group_from_content[number as usize];
        let (pixels, instance) = (open.pixels(), c.first + item.first_instance);
        if let Content::Mesh(mesh) = item.content
            && as_a_whole
        {
            let at = (self.draws(pixels) && pixels > PX_OF_A_SPECK).then(|| c.at.after(group_from_content));
            self.take_for_visible(open, instance, Reason::Shows);
            if let Some(at) = at {
                self.draw(simd, instance, mesh, at);
            }
            return;
        }
        let at = c.at.after(group_from_content);
        let mesh = match item.content {
            Content::Group(group) => return self.enter(group, at, instance),
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
        if occluder.is_empty() || !self.drawn.is_empty() && self.drawn.contains(&instance) {
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

    /// Whether one of the boxes in a mesh's trees shows, down to its blocks of triangles, as long as there are not too
    /// many to ask about. `pixels` are those of the box around it. Blocks come first, for one that shows ends it; then the
    /// nearest node, which is opened at once if it shows: often what is in it shows as well.
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
            self.parts.clear();
            self.parts.push(Part::new(0));
            left = left.saturating_sub(tree.nodes[0].used);
            while let Some((slot, lane)) = self.next_part(simd, &tree.nodes, &view, at) {
                inside = true;
                if let Some(reason) = self.part_is_certain(&view, lane) {
                    return Shows::Yes(reason);
                }
                if self.part_is_hidden(simd, lane) {
                    continue;
                }
                let Child::Node(child) = slot.child() else { return Shows::Yes(Reason::Shows) };
                if left == 0 {
                    return Shows::Yes(Reason::Shows);
                }
                left = left.saturating_sub(tree.nodes[child as usize].used);
                self.parts.push(Part::new(child));
            }
        }
        Shows::No(if inside { Reason::PartsHidden } else { Reason::OutsideView })
    }

    /// A child that was not looked at yet of the node that was opened last, or else of one before it: a block, or the
    /// nearest. Its box is that lane's of the last node. By eights: often one of the first shows.
    #[inline(always)]
    fn next_part<S: Simd>(
        &mut self,
        simd: S,
        nodes: &[WideNode],
        view: &BoxView,
        at: &ScreenFromObject,
    ) -> Option<(Slot, usize)> {
        loop {
            let depth = self.parts.len().checked_sub(1)?;
            if self.part_boxes.len() == depth {
                self.part_boxes.push(BoxesOnScreen::NONE);
            }
            let (part, boxes) = (&mut self.parts[depth], &mut self.part_boxes[depth]);
            let node = &nodes[part.node as usize];
            let mut best: Option<usize> = None;
            for lane in bits(part.lanes) {
                if matches!(node.child[lane].child(), Child::Leaf(_)) {
                    best = Some(lane);
                    break;
                }
                if best.is_none_or(|best| boxes.depth[lane] > boxes.depth[best]) {
                    best = Some(lane);
                }
            }
            if let Some(lane) = best {
                part.lanes &= !(1 << lane);
                return Some((node.child[lane], lane));
            }
            let (from, at_once) = (part.next, S::f32s::LEN.max(8) as u32);
            if from >= node.used {
                self.parts.pop();
                continue;
            }
            if from % at_once == 0 {
                let moved = widened(self.frame, node, at);
                let sides = moved.as_ref().map_or([&node.min, &node.max], |[min, max]| [min, max]);
                project(simd, view, sides, from..node.used.min(from + at_once), boxes);
            }
            part.next = node.used.min(from + 8);
            self.counters.boxes_projected += u64::from(part.next - from);
            for lane in bits(boxes.inside & 0xFF << from) {
                part.lanes |= u16::from(node.child[lane] != Slot::EMPTY) << lane;
            }
        }
    }

    /// Why a part shows that nothing needs to be asked about.
    #[inline(always)]
    fn part_is_certain(&self, view: &BoxView, lane: usize) -> Option<Reason> {
        let boxes = &self.part_boxes[self.parts.len() - 1];
        if boxes.depth[lane] == f32::INFINITY {
            return Some(Reason::ReachesNearPlane);
        }
        (view.margin[0] > 0.0 && boxes.uncut >> lane & 1 == 0).then_some(Reason::Shows)
    }

    #[inline(always)]
    fn part_is_hidden<S: Simd>(&mut self, simd: S, lane: usize) -> bool {
        let boxes = &self.part_boxes[self.parts.len() - 1];
        let rect = [boxes.left[lane], boxes.top[lane], boxes.right[lane], boxes.bottom[lane]];
        let hidden = self.band.hides(simd, rect, boxes.depth[lane]);
        self.counters.boxes_asked += 1;
        if hidden {
            self.counters.boxes_hidden += 1;
            self.credit(rect);
        }
        hidden
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
    fn judge(&mut self, parent: Place, slot: Slot, reason: Reason) {
        if !self.options.reasons {
            return;
        }
        let c = &self.contexts[parent.context as usize];
        let tree = if parent.moving { &c.group.moving } else { &c.group.resting };
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

/// Where some boxes are.
#[inline(always)]
fn project<S: Simd>(
    simd: S,
    view: &BoxView,
    sides: [&[[f32; 16]; 3]; 2],
    lanes: Range<u32>,
    boxes: &mut BoxesOnScreen,
) {
    simd.vectorize(
        #[inline(always)]
        || project_lanes(simd, view, sides, lanes, boxes),
    );
}

/// The boxes of a node as far as what is in them may move, if anything may.
#[inline(always)]
fn widened(frame: &Frame, node: &WideNode, at: &ScreenFromObject) -> Option<[[[f32; 16]; 3]; 2]> {
    frame.moves().then(|| frame.widened(&node.min, &node.max, at).into())
}

/// The lanes whose bits are set.
#[inline(always)]
fn bits(mut mask: u16) -> impl Iterator<Item = usize> {
    std::iter::from_fn(
        #[inline(always)]
        move || {
            let lane = mask.trailing_zeros() as usize & 15;
            let some = mask != 0;
            mask &= mask.wrapping_sub(1);
            some.then_some(lane)
        },
    )
}

/// Which boxes cover fewer pixels; none that may reach the near plane.
#[inline(always)]
fn smaller<S: Simd>(simd: S, boxes: &BoxesOnScreen, px: u32) -> u16 {
    let load = |side: &[i32; 16]| i32x16::from_slice(simd, side);
    let width = load(&boxes.right) - load(&boxes.left) + 1;
    let height = load(&boxes.bottom) - load(&boxes.top) + 1;
    let small = (width * height).simd_lt(px.min(i32::MAX as u32) as i32);
    let beyond = f32x16::from_slice(simd, &boxes.depth).simd_lt(f32::INFINITY);
    (small & beyond).to_bitmask() as u16
}

/// Sorts instances: the nearest is the smallest; of what is equally near, that with the smaller number.
#[inline(always)]
fn key(nearest: f32, instance: u32) -> u64 {
    // Depths that are 0 or more are ordered as their bits are.
    u64::from(!nearest.to_bits()) << 32 | u64::from(instance)
}

/// A node of a mesh's tree being looked at.
struct Part {
    node: u32,
    /// Children that were projected, but not looked at.
    lanes: u16,
    /// The first child that was not projected.
    next: u32,
}

impl Part {
    fn new(node: u32) -> Part {
        Part { node, lanes: 0, next: 0 }
    }
}

enum Shows {
    Yes(Reason),
    No(Reason),
}

/// How many instances a group expands to.
fn instances_of<'a>(mut group: &'a GroupIndex, index: &'a SceneIndex) -> u32 {
    let mut before = 0;
    while let Some(last) = group.items.last() {
        before += last.first_instance;
        match last.content {
            Content::Group(g) => group = &index.groups[g as usize],
            _ => return before + 1,
        }
    }
    before
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
