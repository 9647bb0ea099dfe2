//! Drawing an occluder into a band of the image: the walk of its patches, nearest first, and each patch.

use super::ask::{BoxView, BoxesOnScreen, project_lanes};
use super::clip::{self, Clipped, EdgeOf, clip, doubled_area};
use super::convex;
use super::fill::{Corner, Goes, Joint, Outline, fill, first_pixel, last_pixel};
use super::fine::FinePatch;
use super::loose::{LooseFaces, Sixteen, fill_one, set_up};
use super::mosaic::{Area, Drawing, MOST_EDGES, Mosaic};
use super::occluder::{ENDS, Face, Occluder, Part, Patch};
use super::parts::{Apart, Parts};
use super::pass::Pass;
use super::place::{Placed, Placing, Sizes};
use super::round::{self, Round};
use super::silhouette::Silhouette;
use super::surface::Surface;
use super::worth::{PX_A_CLIPPED_FACE, PX_A_FINE_FACE, area_of, bodies, is_fine};
use super::{Drawn, Margin};
use crate::cull::queue::NearestFirst;
use crate::index::{Child, Slot};
use crate::raster::ScreenFromObject;
use fearless_simd::Simd;

/// Rows of the image, and what is needed to draw into them.
#[derive(Clone, Debug)]
pub(in crate::cull) struct Band {
    pub(super) surface: Surface,
    joint: Joint,
    placed: Placed,
    /// For each face of a patch +1 or −1, its turn on the screen, or 0 if it is not drawn.
    turns: Vec<i8>,
    clipped: Vec<(u32, [Option<Clipped>; 2])>,
    /// Of a patch that is clipped the vertices, homogeneous, and the planes that each is beyond.
    points: Vec<[f64; 4]>,
    beyond: Vec<u8>,
    loose: Box<Sixteen>,
    mosaic: Mosaic,
    parts: Parts,
    silhouette: Silhouette,
    round: round::Room,
    /// The children of a node.
    boxes: Box<BoxesOnScreen>,
    open: NearestFirst<Open>,
}

/// A part of an occluder's tree that may show.
#[derive(Clone, Copy, Debug)]
pub(super) struct Open {
    pub slot: Slot,
    pub rect: [i32; 4],
    pub depth: f32,
    pub farthest: f32,
    pub clear: bool,
}

/// An occluder in its place.
#[derive(Clone, Copy)]
pub(in crate::cull) struct Standing<'a> {
    pub occluder: &'a Occluder,
    pub at: ScreenFromObject,
    /// The eye in its space: a point, or a direction.
    pub eye: [f32; 4],
    pub boxes: BoxView,
    pub(super) sizes: Sizes,
    /// How far the eye may move relative to it.
    pub(super) margin: Option<Margin>,
    /// Columns and rows of the image.
    pub size: [i32; 2],
    /// Patches that touch fewer pixels across or down than this are not worth drawing.
    pub least_px: i32,
    /// Patches whose bounding boxes cover fewer pixels than this for each face are not worth drawing.
    pub px_a_face: i32,
    /// Draw all patches alike, face by face, as if none were loose or fine: slower, to compare with.
    pub plain: bool,
}

impl Band {
    pub fn new(width: u32, top: u32, height: u32) -> Band {
        let surface = Surface::new(width, top, height);
        let joint = Joint::new(&surface);
        Band {
            surface,
            joint,
            placed: Placed::default(),
            turns: vec![],
            clipped: vec![],
            points: vec![],
            beyond: vec![],
            loose: Box::default(),
            mosaic: Mosaic::default(),
            parts: Parts::default(),
            silhouette: Silhouette::default(),
            round: round::Room::default(),
            boxes: Box::new(BoxesOnScreen::NONE),
            open: NearestFirst::new(),
        }
    }

    /// Whether it is all of an image of this size.
    pub fn is_of_size(&self, width: u32, height: u32) -> bool {
        (self.surface.width, self.surface.height, self.surface.top) == (width as i32, height as i32, 0)
    }

    /// Makes it empty.
    pub fn clear(&mut self) {
        self.surface.clear();
    }

    /// Says who draws from now on.
    pub fn drawing(&mut self, who: u32) {
        self.surface.drawing = who;
    }

    /// Who, more or less, hides a rectangle of the surface that is hidden.
    #[inline(always)]
    pub fn who_hides(&self, rect: [i32; 4]) -> u32 {
        self.surface.raised_by(rect)
    }

    /// The part of an image's rectangle (inclusive) in this band, in its own rows.
    #[inline(always)]
    pub fn rows_of(&self, [left, top, right, bottom]: [i32; 4]) -> Option<[i32; 4]> {
        let rect = [
            left,
            (top - self.surface.top).max(0),
            right,
            (bottom - self.surface.top).min(self.surface.height - 1),
        ];
        (rect[1] <= rect[3]).then_some(rect)
    }

    /// Whether an image's rectangle (inclusive) is hidden at `depth`, as far as this band knows.
    #[inline(always)]
    pub fn hides<S: Simd>(&self, simd: S, rect: [i32; 4], depth: f32) -> bool {
        match self.rows_of(rect) {
            Some(rect) => self.surface.all_nearer(simd, rect, depth),
            None => true,
        }
    }

    /// Whether all that was drawn in the tiles of an image's rectangle (inclusive) is farther than `depth`, so that it
    /// hides nothing there that is nowhere beyond.
    #[inline(always)]
    pub fn is_behind(&self, rect: [i32; 4], depth: f32) -> bool {
        self.rows_of(rect).is_none_or(|rect| self.surface.is_behind(rect, depth))
    }

    /// Draws the patches that may show, nearest first.
    #[inline(always)]
    pub fn draw<S: Simd>(&mut self, simd: S, standing: &Standing, drawn: &mut Drawn) {
        let tree = &standing.occluder.tree;
        if tree.nodes.is_empty() {
            return;
        }
        self.open.clear();
        self.visit(simd, standing, 0);
        while let Some(open) = self.open.pop() {
            let hidden = match self.rows_of(open.rect) {
                Some(rect) => simd.vectorize(
                    #[inline(always)]
                    || self.surface.all_nearer_now(simd, rect, open.depth),
                ),
                None => true,
            };
            if hidden {
                drawn.hidden += 1;
                continue;
            }
            match open.slot.child() {
                Child::Node(node) => self.visit(simd, standing, node),
                Child::Leaf(leaf) => match standing.occluder.part(leaf) {
                    Part::Patch(patch) => self.draw_passes(simd, standing, patch, open, drawn),
                    Part::Loose(faces) => {
                        // Those that reach the near plane are patches like others.
                        let patches = match standing.plain {
                            true => faces.lanes,
                            false => simd.vectorize(
                                #[inline(always)]
                                || self.draw_loose(simd, standing, faces, drawn),
                            ),
                        };
                        if patches != 0 {
                            self.open_loose(simd, standing, faces, patches);
                        }
                    }
                },
            }
        }
        simd.vectorize(
            #[inline(always)]
            || self.surface.refresh(simd),
        );
    }

    /// Opens the children of a node that the image may show.
    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, standing: &Standing, number: u32) {
        let node = &standing.occluder.tree.nodes[number as usize];
        simd.vectorize(
            #[inline(always)]
            || project_lanes(simd, &standing.boxes, [&node.min, &node.max], 0..node.used, &mut self.boxes),
        );
        self.open_lanes(standing, self.boxes.inside, |lane| node.child[lane]);
    }

    /// Opens faces of a block as patches by themselves.
    #[inline(never)]
    fn open_loose<S: Simd>(&mut self, simd: S, standing: &Standing, faces: &LooseFaces, lanes: u16) {
        let [min, max] = faces.sides();
        simd.vectorize(
            #[inline(always)]
            || project_lanes(simd, &standing.boxes, [&min, &max], 0..16, &mut self.boxes),
        );
        self.open_lanes(standing, self.boxes.inside & lanes, |lane| Slot::leaf(faces.patch[lane] as usize));
    }

    /// Opens what lies in some of the boxes that were projected last.
    #[inline(always)]
    fn open_lanes(&mut self, standing: &Standing, lanes: u16, slot: impl Fn(usize) -> Slot) {
        let mut rest = lanes;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let boxes = &self.boxes;
            let rect = [boxes.left[lane], boxes.top[lane], boxes.right[lane], boxes.bottom[lane]];
            let clear = boxes.clear >> lane & 1 == 1;
            let extent = (rect[2] - rect[0]).min(rect[3] - rect[1]);
            let slot = slot(lane);
            if slot == Slot::EMPTY || self.rows_of(rect).is_none() {
                continue;
            }
            let (depth, farthest) = (boxes.depth[lane], boxes.farthest[lane]);
            let open = Open { slot, rect, depth, farthest, clear };
            let is_small = extent < standing.least_px;
            let is_left_out = match slot.child() {
                Child::Leaf(leaf) if let Part::Patch(patch) = standing.occluder.part(leaf) => {
                    is_small || bodies(standing, patch, &open).is_none()
                }
                // Loose faces in it may be larger beyond the border; whether they are is asked of each.
                _ => is_small && boxes.uncut >> lane & 1 == 1,
            };
            if is_left_out {
                continue;
            }
            self.open.push(open, open.depth);
        }
    }

    /// Draws a patch in as many passes as a margin takes.
    #[inline(always)]
    fn draw_passes<S: Simd>(
        &mut self,
        simd: S,
        standing: &Standing,
        patch: &Patch,
        open: Open,
        drawn: &mut Drawn,
    ) {
        let Some(bodies) = bodies(standing, patch, &open) else { return };
        let mut next = Pass::first(standing, open);
        while let Some(pass) = next {
            simd.vectorize(
                #[inline(always)]
                || self.draw_patch(simd, standing, patch, &pass, bodies, drawn),
            );
            // Bodies lie beyond all that must be cut.
            next = if bodies.is_empty() { pass.after(standing, patch) } else { None };
        }
    }

    /// Draws faces that are patches by themselves. Returns the lanes of those that must be clipped first.
    #[inline(always)]
    fn draw_loose<S: Simd>(
        &mut self,
        simd: S,
        standing: &Standing,
        faces: &LooseFaces,
        drawn: &mut Drawn,
    ) -> u16 {
        let sixteen = &mut self.loose;
        let sorted = set_up(simd, faces, standing, sixteen);
        let mut rest = sorted.draw;
        drawn.patches += u64::from(rest.count_ones());
        drawn.faces += u64::from(rest.count_ones());
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize & 15;
            rest &= rest - 1;
            fill_one(simd, &mut self.surface, sixteen, lane);
        }
        sorted.clip
    }

    /// Draws a patch: as the bodies that are given, if there are any.
    #[inline(always)]
    fn draw_patch<S: Simd>(
        &mut self,
        simd: S,
        standing: &Standing,
        patch: &Patch,
        pass: &Pass,
        bodies: &[Patch],
        drawn: &mut Drawn,
    ) {
        let Pass { placing, jointly, .. } = *pass;
        let Open { clear, rect, .. } = pass.open;
        let plain = standing.plain || jointly || !clear;
        self.draw_bodies(simd, standing, bodies, &placing, drawn);
        if !bodies.is_empty() {
            return;
        }
        if let (false, Some(body)) = (plain, &patch.round)
            && let Some(faces) = self.draw_round(simd, standing, pass, body)
        {
            drawn.patches += 1;
            drawn.faces += faces;
            return;
        }
        let faces = &standing.occluder.faces[patch.first_face as usize..][..patch.faces as usize];
        if let (false, Some(fine)) = (plain, &patch.fine)
            && is_fine(rect, patch.faces as usize, PX_A_FINE_FACE)
            && let Some(rect) = self.rows_of(rect)
        {
            let fine = standing.occluder.fine.get(fine, patch.faces);
            placing.place(simd, &standing.occluder.vertices, patch, &mut self.placed);
            self.mosaic.take_turns(simd, &fine, standing.eye);
            if self.draw_fine(
                simd,
                standing,
                faces,
                fine,
                (apart(standing, patch, pass), placing.slack, rect),
                drawn,
            ) {
                return;
            }
        }
        self.clipped.clear();
        if clear {
            self.placed_turns(simd, standing, patch, &placing, faces);
        } else {
            self.clipped_turns(standing, patch, &placing, faces);
        }
        let margin_px = if jointly { pass.margin_px(standing, self.placed.nearest) } else { Some(0) };
        let Some(margin_px) = margin_px else { return };
        drawn.patches += 1;
        let count = self.turns.iter().filter(|turn| **turn != 0).count();
        drawn.faces += count as u64;
        let around = (!(clear || standing.plain || jointly))
            .then(|| self.around_clipped(faces, placing.slack, standing.size))
            .filter(|rect| is_fine(*rect, count, PX_A_CLIPPED_FACE));
        // Faces that are filled one by one have depths of their own.
        let may = around.is_some() || jointly || (standing.plain && patch.fine.is_some());
        let apart = if may { apart(standing, patch, pass) } else { Apart::Not };
        let parts = self.take_apart(faces, apart, false);
        for part in 0..parts {
            if parts > 1 {
                self.parts.choose(part, &mut self.turns);
            }
            self.draw_turned(simd, faces, placing.slack, around, margin_px);
        }
    }

    /// Draws a patch that is a round body. Returns how many of its faces are seen; nothing, if it must be drawn in another
    /// way.
    #[inline(always)]
    fn draw_round<S: Simd>(
        &mut self,
        simd: S,
        standing: &Standing,
        pass: &Pass,
        body: &Round,
    ) -> Option<u64> {
        let Open { depth, farthest, rect, .. } = pass.open;
        let drawing = round::Drawing {
            body: standing.occluder.round.get(body),
            standing,
            placing: &pass.placing,
            rect,
            nearest: depth,
            farthest,
        };
        round::draw(
            simd,
            &mut self.surface,
            (&mut self.silhouette, &mut self.placed, &mut self.round),
            &drawing,
        )
    }

    /// Draws a patch whose corners are placed and whose turns the mosaic has. False if it must be drawn in another way.
    #[inline(always)]
    fn draw_fine<S: Simd>(
        &mut self,
        simd: S,
        standing: &Standing,
        faces: &[Face],
        fine: FinePatch,
        (apart, slack, rect): (Apart, i32, [i32; 4]),
        drawn: &mut Drawn,
    ) -> bool {
        let front_sign = standing.at.front_sign as i32;
        let parts = self.take_apart(faces, apart, true);
        for part in 0..parts {
            if parts > 1 {
                self.parts.choose(part, self.mosaic.turns());
            }
            let drawing = Drawing { patch: fine, placed: &self.placed, front_sign, slack, rect };
            let Some(faces) = self.mosaic.draw(simd, &mut self.surface, &drawing) else { return false };
            drawn.faces += faces;
        }
        drawn.patches += 1;
        true
    }

    /// Takes a patch whose turns are known apart, where that may pay. Returns how many parts there are.
    #[inline(always)]
    fn take_apart(&mut self, faces: &[Face], apart: Apart, fine: bool) -> usize {
        match apart {
            Apart::Not => 1,
            _ => self.find_parts(faces, apart, fine),
        }
    }

    #[inline(never)]
    fn find_parts(&mut self, faces: &[Face], apart: Apart, fine: bool) -> usize {
        let turns = if fine { &*self.mosaic.turns() } else { &self.turns };
        let parts = self.parts.find(faces, turns);
        if parts > 1 || apart != Apart::ByDepth {
            return parts;
        }
        let placed = &self.placed;
        self.parts.find_near(|f| {
            let [a, b, c, d] = placed.corners(&faces[f].corner).map(|c| c.depth);
            let least = a.min(b).min(c.min(d));
            // Of a corner that was not placed, for it is clipped.
            if least == 0.0 { f32::INFINITY } else { least }
        })
    }

    /// Draws the faces of a patch that have a turn, placed or clipped: by their outline, if all that it may touch of the
    /// image is given.
    #[inline(always)]
    fn draw_turned<S: Simd>(
        &mut self,
        simd: S,
        faces: &[Face],
        slack: i32,
        around: Option<[i32; 4]>,
        margin_px: i32,
    ) {
        if let Some(rect) = around {
            let Some(rect) = self.rows_of(rect) else { return };
            if self.clipped_mosaic(simd, faces, rect, slack) {
                return;
            }
        }
        let goes = if margin_px > 0 { Goes::Jointly } else { Goes::Apart };
        self.fill_faces(simd, faces, slack, goes);
        if margin_px > 0 {
            self.joint.finish_eroded(simd, &mut self.surface, self.placed.nearest, margin_px);
        } else {
            self.joint.finish(simd, &mut self.surface, self.placed.nearest);
        }
    }

    #[inline(always)]
    fn draw_bodies<S: Simd>(
        &mut self,
        simd: S,
        standing: &Standing,
        bodies: &[Patch],
        placing: &Placing,
        drawn: &mut Drawn,
    ) {
        for body in bodies {
            let Some(convex) = body.convex else { continue };
            placing.place(simd, &standing.occluder.vertices, body, &mut self.placed);
            let drawing = convex::Drawing {
                body: &standing.occluder.convex[convex as usize],
                placed: &self.placed,
                eye: standing.eye,
                front_sign: standing.at.front_sign as i32,
                slack: placing.slack,
            };
            let faces = convex::draw(simd, &mut self.surface, &mut self.silhouette, &drawing);
            drawn.patches += u64::from(faces > 0);
            drawn.faces += faces;
        }
    }

    /// The pixels of an image that what is drawn of a patch may touch; the last before the first if there is none.
    fn around_clipped(&self, faces: &[Face], slack: i32, [width, height]: [i32; 2]) -> [i32; 4] {
        let [mut left, mut top, mut right, mut bottom] = [i32::MAX, i32::MAX, i32::MIN, i32::MIN];
        let mut take = |c: &Corner| {
            (left, top) = (left.min(c.x), top.min(c.y));
            (right, bottom) = (right.max(c.x), bottom.max(c.y));
        };
        let mut next = 0;
        for (f, face) in faces.iter().enumerate() {
            if self.turns[f] == 0 {
                continue;
            }
            match pieces_of(&self.clipped, &mut next, f) {
                Some(pieces) => {
                    let corners = pieces.iter().flatten().flat_map(|piece| &piece.corner[..piece.len]);
                    corners.for_each(|(corner, _)| take(corner));
                }
                _ => self.placed.corners(&face.corner).iter().for_each(&mut take),
            }
        }
        if left > right {
            return [0, 0, -1, -1];
        }
        [
            first_pixel(left, slack).max(0),
            first_pixel(top, slack).max(0),
            last_pixel(right, slack).min(width - 1),
            last_pixel(bottom, slack).min(height - 1),
        ]
    }

    /// Draws a patch, whose turns are known and whose corners are placed or clipped, by its outline. False if that is too
    /// long.
    #[inline(always)]
    fn clipped_mosaic<S: Simd>(&mut self, simd: S, faces: &[Face], rect: [i32; 4], slack: i32) -> bool {
        if rect[0] > rect[2] {
            return true;
        }
        let ends = |(f, face): (usize, &Face)| match self.turns[f] {
            0 => 0,
            _ => ends_of(face, f, &self.turns).count_ones() as usize,
        };
        if faces.len() * 4 > MOST_EDGES && faces.iter().enumerate().map(ends).sum::<usize>() > MOST_EDGES {
            return false;
        }
        let area = self.mosaic.begin(&self.surface, rect, slack);
        let mut next = 0;
        for (f, face) in faces.iter().enumerate() {
            let turn = i32::from(self.turns[f]);
            if turn == 0 {
                continue;
            }
            let (ends, count) = (ends_of(face, f, &self.turns), usize::from(face.corners));
            let Some(pieces) = pieces_of(&self.clipped, &mut next, f) else {
                let corner = self.placed.corners(&face.corner);
                self.face_of_mosaic(simd, &area, Outline { corner, corners: count, turn, ends: ALL }, slack);
                for k in (0..count).filter(|k| ends >> k & 1 == 1) {
                    self.mosaic.edge(&corner[k], &corner[(k + 1) % count], turn);
                }
                continue;
            };
            for (p, piece) in pieces.iter().enumerate() {
                let Some(piece) = piece else { continue };
                let ends = if count == 3 { ends } else { ends_of_half(ends, p, pieces[1 - p].is_none()) };
                for i in 1..piece.len - 1 {
                    let outline = Outline { ends: ALL, ..of_fan(piece, i, turn, ends) };
                    self.face_of_mosaic(simd, &area, outline, slack);
                }
                for i in (0..piece.len).filter(|&i| end_after(piece, i, ends) == 1) {
                    self.mosaic.edge(&piece.corner[i].0, &piece.corner[(i + 1) % piece.len].0, turn);
                }
            }
        }
        self.mosaic.end(simd, &mut self.surface, &area, self.placed.nearest)
    }

    /// Takes a face for the mosaic. A large one is filled by itself, too: where it covers whole blocks, what is farther
    /// of its patch does not count.
    #[inline(never)]
    fn face_of_mosaic<S: Simd>(&mut self, simd: S, area: &Area, outline: Outline, slack: i32) {
        let nearest = self.placed.nearest;
        let (surface, joint, mosaic) = (&mut self.surface, &mut self.joint, &mut self.mosaic);
        simd.vectorize(
            #[inline(always)]
            || {
                mosaic.face(simd, area, &outline.corner, outline.corners == 4);
                if outline.is_large() {
                    fill(simd, surface, joint, &outline, slack, nearest, Goes::InBlocks);
                }
            },
        );
    }

    /// Fills the faces of a patch, whose turns are known and whose corners are placed or clipped.
    #[inline(always)]
    fn fill_faces<S: Simd>(&mut self, simd: S, faces: &[Face], slack: i32, goes: Goes) {
        let (surface, joint, nearest) = (&mut self.surface, &mut self.joint, self.placed.nearest);
        // Those that were clipped come in the order of the faces.
        let mut next = 0;
        for (f, face) in faces.iter().enumerate() {
            let turn = i32::from(self.turns[f]);
            if turn == 0 {
                continue;
            }
            let ends = ends_of(face, f, &self.turns);
            let corner = self.placed.corners(&face.corner);
            let Some(pieces) = pieces_of(&self.clipped, &mut next, f) else {
                let outline = Outline { corner, corners: usize::from(face.corners), turn, ends };
                fill(simd, surface, joint, &outline, slack, nearest, goes);
                continue;
            };
            for (p, piece) in pieces.iter().enumerate() {
                let Some(piece) = piece else { continue };
                let ends =
                    if face.corners == 3 { ends } else { ends_of_half(ends, p, pieces[1 - p].is_none()) };
                for i in 1..piece.len - 1 {
                    let outline = of_fan(piece, i, turn, ends);
                    fill(simd, surface, joint, &outline, slack, nearest, goes);
                }
            }
        }
    }

    /// Places a patch that needs no clipping and says which way its faces turn.
    #[inline(always)]
    fn placed_turns<S: Simd>(
        &mut self,
        simd: S,
        standing: &Standing,
        patch: &Patch,
        placing: &Placing,
        faces: &[Face],
    ) {
        placing.place(simd, &standing.occluder.vertices, patch, &mut self.placed);
        let front = standing.at.front_sign as i32;
        self.turns.clear();
        for face in faces {
            self.turns.push(placed_turn(&self.placed, face, front));
        }
    }

    /// Places each vertex of a patch that needs clipping, as [`clip()`] would, and notes what it is beyond.
    fn place_apart(&mut self, standing: &Standing, patch: &Patch, placing: &Placing) {
        let vertices = &standing.occluder.vertices;
        let (first, count) = (patch.first_vertex as usize, patch.vertices as usize);
        self.points.clear();
        self.beyond.clear();
        self.placed.corner.clear();
        for i in first..first + count {
            let p = placing.at.point([vertices.x[i], vertices.y[i], vertices.z[i]].map(f64::from));
            let beyond = clip::beyond(&p);
            self.placed.corner.push(if beyond == 0 { clip::snapped(&p, placing).bits() } else { [0; 4] });
            self.points.push(p);
            self.beyond.push(beyond);
        }
    }

    /// Clips a patch's faces one by one and says which way what is left of them turns.
    #[inline(never)]
    fn clipped_turns(&mut self, standing: &Standing, patch: &Patch, placing: &Placing, faces: &[Face]) {
        self.place_apart(standing, patch, placing);
        let front = standing.at.front_sign as i32;
        self.turns.clear();
        self.placed.nearest = 0.0;
        for (f, face) in faces.iter().enumerate() {
            let [a, b, c, d] = face.corner.map(|v| self.beyond[v as usize]);
            if a & b & c & d != 0 {
                // Nothing of it lies inside.
                self.turns.push(0);
                continue;
            }
            if a | b | c | d == 0 {
                let turn = placed_turn(&self.placed, face, front);
                self.turns.push(turn);
                if turn != 0 {
                    let depths = self.placed.corners(&face.corner).map(|c| c.depth);
                    self.placed.nearest = depths.into_iter().fold(self.placed.nearest, f32::max);
                }
                continue;
            }
            let c = face.corner.map(|v| self.points[v as usize]);
            let two = face.corners == 4;
            let pieces =
                [clip([c[0], c[1], c[2]], placing), two.then(|| clip([c[0], c[2], c[3]], placing)).flatten()];
            let mut signs = pieces.iter().flatten().map(|p| p.sign);
            let first = signs.next();
            let sign = first.filter(|&s| s != 0 && signs.all(|other| other == s));
            let turn = turn_of(sign.unwrap_or(0), front, face.two_sided);
            // Where the pieces disagree, and where nothing is left, nothing is drawn.
            self.turns.push(if sign.is_some() { turn } else { 0 });
            if sign.is_some() && turn != 0 {
                for piece in pieces.iter().flatten() {
                    let depths = piece.corner[..piece.len].iter().map(|c| c.0.depth);
                    self.placed.nearest = depths.fold(self.placed.nearest, f32::max);
                }
                self.clipped.push((f as u32, pieces));
            }
        }
    }
}

/// How far a patch may be taken apart, by where it lies on all of the image.
#[inline(always)]
fn apart(standing: &Standing, patch: &Patch, pass: &Pass) -> Apart {
    let Open { depth, farthest, rect, .. } = pass.open;
    let image = i64::from(standing.size[0]) * i64::from(standing.size[1]);
    Apart::of(patch.folds, patch.faces, [farthest, depth], area_of(rect), image)
}

/// The pieces of face `f`, if it was clipped; `next` is the first not yet passed.
#[inline(always)]
fn pieces_of(
    clipped: &[(u32, [Option<Clipped>; 2])],
    next: &mut usize,
    f: usize,
) -> Option<[Option<Clipped>; 2]> {
    while clipped.get(*next).is_some_and(|c| (c.0 as usize) < f) {
        *next += 1;
    }
    clipped.get(*next).filter(|c| c.0 as usize == f).map(|c| c.1)
}

/// An orthographic depth is kept no more than that below the true one, and a share of it: see [`Placing::depth`].
pub(super) const DEPTH_IS_LESS: f64 = 4e-6;

/// The surface ends at every edge of a face, as far as the face knows.
const ALL: u32 = 15;

/// The turn of a face whose corners are placed, or 0 if it is not drawn.
#[inline(always)]
fn placed_turn(placed: &Placed, face: &Face, front: i32) -> i8 {
    let c = placed.corners(&face.corner);
    let sign = if face.corners == 3 {
        doubled_area(&c[0], &c[1], &c[2]).signum() as i32
    } else {
        let t = [
            doubled_area(&c[0], &c[1], &c[2]),
            doubled_area(&c[1], &c[2], &c[3]),
            doubled_area(&c[2], &c[3], &c[0]),
            doubled_area(&c[3], &c[0], &c[1]),
        ];
        let (low, high) = (t[0].min(t[1]).min(t[2].min(t[3])), t[0].max(t[1]).max(t[2].max(t[3])));
        // Turns that differ: seen so nearly edge-on that it is no convex outline.
        if low < 0 && high > 0 {
            return 0;
        }
        high.signum() as i32 + low.signum() as i32
    };
    turn_of(sign.signum(), front, face.two_sided)
}

/// +1 or −1 for a face that is drawn, else 0. `sign` is that of its area on the screen.
#[inline(always)]
fn turn_of(sign: i32, front: i32, two_sided: bool) -> i8 {
    match sign {
        // Edge-on: it covers nothing, but joins its neighbours.
        0 => front as i8,
        s if s == front || two_sided => s as i8,
        _ => 0,
    }
}

/// Bit k: the face that is drawn across edge k does not continue this one.
#[inline(always)]
fn ends_of(face: &Face, f: usize, turns: &[i8]) -> u32 {
    let mut ends = 0;
    for k in 0..usize::from(face.corners) {
        let across = face.across[k];
        if across == ENDS || turns[across as usize] != turns[f] {
            ends |= 1 << k;
        }
    }
    ends
}

/// The ends of one half of a face of four: corners 0, 1, 2 or 0, 2, 3. The diagonal ends where the other half
/// is gone.
fn ends_of_half(ends: u32, half: usize, alone: bool) -> u32 {
    if half == 0 { (ends & 3) | u32::from(alone) << 2 } else { (ends >> 1 & 6) | u32::from(alone) }
}

/// Triangle `i`, from 1, of a clipped piece's fan, whose diagonals are shared. `ends` are those of the triangle that
/// was clipped.
#[inline(always)]
fn of_fan(piece: &Clipped, i: usize, turn: i32, ends: u32) -> Outline {
    let corner = [piece.corner[0].0, piece.corner[i].0, piece.corner[i + 1].0, piece.corner[0].0];
    let mut bits = end_after(piece, i, ends) << 1;
    if i == 1 {
        bits |= end_after(piece, 0, ends);
    }
    if i == piece.len - 2 {
        bits |= end_after(piece, piece.len - 1, ends) << 2;
    }
    Outline { corner, corners: 3, turn, ends: bits }
}

/// 1 if the surface ends at the edge that follows corner `i`.
#[inline(always)]
fn end_after(piece: &Clipped, i: usize, ends: u32) -> u32 {
    match piece.corner[i].1 {
        EdgeOf::Cut => 1,
        EdgeOf::Triangle(k) => ends >> k & 1,
    }
}
