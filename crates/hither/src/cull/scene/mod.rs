//! Culling a scene: which instances may be seen, front to back.
//!
//! ```text
//! draw what hid something last time, in the order of then
//! walk the index nearest first:
//!     a box that the buffer hides, or that is outside: drop it, with all that is in it
//!     boxes of a node that are too small to hold an occluder: put them aside
//!     an instance: if one of the boxes of its mesh's tree shows, it may be seen;
//!                  if it is large enough, draw its opaque surfaces at once, so that they hide what is behind
//! now that everything is drawn:
//!     ask once more about all that may be seen
//!     walk what was put aside, depth first, in the same way; nothing of it is drawn or asked about again
//! sort what may be seen by depth
//! ```
//!
//! *Occluders* are chosen by size on the screen: an instance is drawn if its box covers so many pixels, and of
//! its surface the pieces that are large enough. With coherence each box that is found hidden counts for who was
//! drawn last in its middle, and an occluder of many faces that little counted for is not tried again for some
//! frames. A view that jumps begins anew: what hid nothing from there may hide everything from here. Transparent
//! surfaces never hide, and masked ones only where the mask cannot have a hole. Nothing is kept of where an occluder
//! is, so one that moves or is switched off costs nothing but its place in the index.
//!
//! The verdicts are those of the conservative buffer: an instance that is left out shows at no point of the
//! continuous image; or, with [`Meaning::Sampled`], at no pixel's centre. As the former holds at every resolution, the
//! buffer's pixels may be coarser than the view's ([`CullOptions::coarseness`]).
//!
//! *Tried, and not kept.* Occluders by the area-angle of their surfaces [Coorg & Teller 1996], summed over each mesh
//! for the three axes, against that of the box around it, instead of by the box alone: 2 to 7 % fewer faces at 0.6 %
//! more instances found in a market of 22,000 parts, and nothing in an office of open modules, of which each covers
//! as much as the threshold asks. No look inside meshes of a single box: no difference beyond what one run differs
//! from the next.

mod walk;

use super::Meaning;
use super::buffer::{Band, Frame, Occluder, OcclusionOptions};
use crate::conventions::{View, ViewError};
use crate::index::SceneIndex;
use crate::scene::HidingMaterials;
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;
use std::collections::HashMap;

/// What may be chosen about culling a scene.
#[derive(Clone, Copy, Debug)]
pub struct CullOptions {
    /// How far the eye may move, metres, while the answer is to stay true. It must not turn.
    pub eye_moves: f64,
    /// How far each object may move, metres, while the answer is to stay true.
    pub objects_move: f64,
    /// Where an instance must show. Sampled, with nothing that moves.
    pub meaning: Meaning,
    /// Occluders are drawn, and boxes asked about, at so many of the view's pixels across and down a pixel: 1, 2, 4 or
    /// any other number; by default 2 in views of more than [`MANY_PIXELS`], else 1. The answer is as true, whatever it
    /// is; more cost less, and leave out less, above all of what is seen through gaps of a few pixels. Thresholds in
    /// pixels are rounded up to whole ones of these, and lengths to one more. 1 if sampled: centres are those of the
    /// view's pixels.
    pub coarseness: Option<u32>,
    /// Instances whose boxes cover fewer pixels of the view than this are not drawn as occluders. Smaller hides more,
    /// and costs more.
    pub least_occluder_px: u32,
    /// Connected pieces of an occluder that touch fewer pixels of the view across or down are left out.
    pub least_piece_px: u32,
    /// So are pieces whose bounding boxes cover fewer pixels of the view than this for each of their faces: they cost
    /// more than they hide. In a view of fewer pixels than 1920×1080, so much less. Of closed convex pieces of few faces a
    /// sixteenth is enough. If another is closed, and large enough, a few boxes inside of it are drawn instead.
    pub least_px_a_face: u32,
    /// Boxes of a mesh's own tree that are asked about before an instance counts as visible.
    pub boxes_an_instance: u32,
    /// Start by drawing what hid something in this culler's last frame of the same view number, in the order of then;
    /// leave out for some frames what was drawn and hid too little. A frame whose eye goes or turns more than four
    /// times as far as the last one's did, or turns by half a radian, begins from nothing; so does one of another
    /// projection or size.
    pub coherence: bool,
    /// With coherence, an occluder of which more faces than this were drawn for each box that it hid, and for one
    /// more, is left out for some frames.
    pub faces_a_hidden_box: u32,
    /// Also say of every instance why it was judged as it was; slower.
    pub reasons: bool,
    /// Instruction set; the best that the machine has by default. Answers do not depend on it.
    pub level: Level,
}

/// In views of more pixels than this, pixels twice as wide and high are the default: in a castle with a market, at
/// 1920×1080, they took 52 to 92 % of the time and left in up to 4 % more.
pub const MANY_PIXELS: u64 = 1_000_000;

impl CullOptions {
    /// How many pixels of a view of that width and height go across and down one of those that it is culled with.
    pub fn coarseness_in(&self, (width, height): (u32, u32)) -> u32 {
        let pixels = u64::from(width) * u64::from(height);
        let by_default = if self.meaning == Meaning::Continuous && pixels > MANY_PIXELS { 2 } else { 1 };
        self.coarseness.unwrap_or(by_default)
    }
}

impl Default for CullOptions {
    fn default() -> Self {
        CullOptions {
            eye_moves: 0.0,
            objects_move: 0.0,
            meaning: Meaning::Continuous,
            coarseness: None,
            least_occluder_px: 800,
            least_piece_px: 6,
            least_px_a_face: 64,
            boxes_an_instance: 256,
            coherence: false,
            faces_a_hidden_box: 64,
            reasons: false,
            level: Level::new(),
        }
    }
}

/// Why an instance, or several with consecutive numbers, were judged as they were.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reason {
    /// A box of it shows between the occluders.
    Shows,
    /// A box around it reaches the near plane.
    ReachesNearPlane,
    /// Nothing of it is beyond the near plane, before an orthographic view's far one, and inside the picture's sides;
    /// sampled, nothing at a pixel's centre.
    OutsideView,
    /// Occluders hide a box around it, or around the group that it is in.
    BoxHidden,
    /// Its box shows, but occluders hide each of the smaller boxes around its surface.
    PartsHidden,
    /// It was taken for visible, and was found hidden when everything was drawn.
    HiddenAfterAll,
}

/// Instances with consecutive numbers, and why they were judged as they were.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Judged {
    /// Their numbers.
    pub instances: std::ops::Range<u32>,
    /// Why.
    pub reason: Reason,
}

/// What culling did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullCounters {
    /// Boxes of trees that were projected; of meshes' trees by eights, until one shows.
    pub boxes_projected: u64,
    /// Boxes that were asked about.
    pub boxes_asked: u64,
    /// Of these, hidden.
    pub boxes_hidden: u64,
    /// Instances drawn as occluders.
    pub occluders: u64,
    /// Instances not drawn because they hid too little lately.
    pub occluders_idle: u64,
    /// Connected pieces of these that were drawn.
    pub occluder_patches: u64,
    /// Faces of these.
    pub occluder_faces: u64,
    /// Instances taken for visible at first and found hidden at the end.
    pub second_thoughts: u64,
}

/// What may be seen of a scene from one eye.
#[derive(Clone, Debug, Default)]
pub struct Culling {
    /// Numbers of the instances that may be seen, nearest first: by the nearest points of their boxes, along the axis
    /// of the view.
    pub visible: Vec<u32>,
    /// Why, for all instances of which there is something to see (not of empty meshes, nor of what is switched off), in
    /// no particular order; empty unless asked for.
    pub judged: Vec<Judged>,
    /// What was done.
    pub counters: CullCounters,
}

/// Culls frames and keeps what is worth keeping between them: occluders, buffers, and what hid something last.
#[derive(Debug, Default)]
pub struct Culler {
    /// Which index the occluders are of.
    serial: Option<u64>,
    occluders: Vec<Occluder>,
    views: Vec<OneView>,
}

/// What is kept for one of several views.
#[derive(Debug, Default)]
struct OneView {
    band: Option<Band>,
    /// The last frame's view, and how it came from that before.
    view: Option<View>,
    motion: Motion,
    /// Instances drawn as occluders in the last frame that hid something, in the order of drawing: nearest first, or as
    /// in the frame before.
    hid: Vec<Hid>,
    /// Instances that hid too little when they were last drawn, and for how many frames they are not tried again.
    idle: HashMap<u32, u32>,
}

/// Radians between two frames that have little to show in common.
const MOST_TURNED: f64 = 0.5;

/// How a view came from another.
#[derive(Clone, Copy, Debug, Default)]
struct Motion {
    /// Metres that the eye went.
    went: f64,
    /// Radians that it turned, more or less.
    turned: f64,
}

impl Motion {
    /// Nothing if the views differ in more than where they look from.
    fn between(before: &View, now: &View) -> Option<Motion> {
        let alike =
            before.projection == now.projection && (before.width, before.height) == (now.width, now.height);
        let turn = before.view_from_world.matrix3 - now.view_from_world.matrix3;
        let turned = turn.x_axis.length().max(turn.y_axis.length()).max(turn.z_axis.length());
        alike.then(|| Motion { went: before.eye_in_world().distance(now.eye_in_world()), turned })
    }

    /// Whether it goes on as before, or comes to rest: no jump.
    fn goes_on(&self, before: &Motion) -> bool {
        self.went <= before.went * 4.0 + 0.001 && self.turned <= (before.turned * 4.0 + 0.01).min(MOST_TURNED)
    }
}

/// An instance drawn as an occluder.
#[derive(Clone, Copy, Debug)]
struct Hid {
    instance: u32,
    /// Boxes found hidden, in the middle of which it was drawn last.
    boxes: u32,
    /// Faces that were drawn.
    faces: u32,
}

/// An occluder that hid too little is left out for so many frames, or up to twice as many, so that not all are tried
/// again in the same frame.
const IDLE_FRAMES: u32 = 8;

impl Culler {
    /// A culler that knows nothing yet.
    pub fn new() -> Culler {
        Culler::default()
    }

    /// Makes the meshes of `index` ready to hide. [`Culler::cull`] does so by itself when it meets another
    /// index than the last time, and forgets that one: keep a culler for each index. Cost: n log n in stored triangles.
    pub fn prepare(&mut self, index: &SceneIndex) {
        if self.serial != Some(index.serial) {
            let scene = index.scene();
            let materials = HidingMaterials::new(scene);
            let prepare = |mesh| Occluder::of_mesh(mesh, materials.of(mesh));
            self.occluders = scene.meshes.par_iter().map(prepare).collect();
            self.serial = Some(index.serial);
            self.views.clear();
        }
    }

    /// Which instances may be seen in `view`.
    pub fn cull(
        &mut self,
        index: &SceneIndex,
        view: &View,
        options: &CullOptions,
    ) -> Result<Culling, ViewError> {
        let all = self.cull_views(index, std::slice::from_ref(view), options)?;
        Ok(all.into_iter().next().unwrap_or_default())
    }

    /// Which instances may be seen in each of several views: the cascades of a shadow, the faces of a cube, two
    /// eyes (of a headset, not sampled: [`View::around_off_axis`]). They are culled at once, on as many threads as
    /// rayon has.
    pub fn cull_views(
        &mut self,
        index: &SceneIndex,
        views: &[View],
        options: &CullOptions,
    ) -> Result<Vec<Culling>, ViewError> {
        let choice = OcclusionOptions {
            eye_moves: options.eye_moves,
            objects_move: options.objects_move,
            level: options.level,
        };
        let frame = |view: &View| {
            let coarseness = options.coarseness_in((view.width, view.height));
            Frame::new(view, &choice)?.meaning(options.meaning)?.coarser(coarseness)
        };
        let frames: Vec<Frame> = views.iter().map(frame).collect::<Result<_, _>>()?;
        self.prepare(index);
        self.views.resize_with(views.len(), OneView::default);
        let occluders = &self.occluders;
        let one = |(kept, frame): (&mut OneView, &Frame)| kept.cull(index, occluders, frame, options);
        Ok(match views.len() {
            1 => self.views.iter_mut().zip(&frames).map(one).collect(),
            _ => self.views.par_iter_mut().zip(&frames).map(one).collect(),
        })
    }
}

/// What is known from the last frame.
struct Before<'a> {
    hid: &'a [Hid],
    idle: &'a HashMap<u32, u32>,
}

impl OneView {
    fn cull(
        &mut self,
        index: &SceneIndex,
        occluders: &[Occluder],
        frame: &Frame,
        options: &CullOptions,
    ) -> Culling {
        let (width, height) = (frame.view.width, frame.view.height);
        let mut band = match self.band.take() {
            Some(mut band) if band.is_of_size(width, height) => {
                band.clear();
                band
            }
            _ => Band::new(width, 0, height),
        };
        let mut before = std::mem::take(&mut self.hid);
        let motion = self.view.and_then(|view| Motion::between(&view, &frame.view));
        if !(options.coherence && motion.is_some_and(|m| m.goes_on(&self.motion))) {
            before.clear();
            self.idle.clear();
        }
        (self.view, self.motion) = (Some(frame.view), motion.unwrap_or_default());
        let before = Before { hid: &before, idle: &self.idle };
        let culling = dispatch!(options.level, simd => {
            walk::cull(simd, index, occluders, frame, options, &mut band, &before, &mut self.hid)
        });
        self.idle.retain(|_, frames| {
            *frames -= 1;
            *frames > 0
        });
        let idle = &mut self.idle;
        self.hid.retain(|h| {
            let pays = h.faces <= (h.boxes + 1).saturating_mul(options.faces_a_hidden_box);
            if !pays {
                idle.insert(h.instance, IDLE_FRAMES + h.instance % IDLE_FRAMES);
            }
            pays && h.boxes > 0
        });
        self.band = Some(band);
        culling
    }
}

/// Which instances of `index` may be seen in `view`, from scratch. [`Culler`] is for more than one frame: making
/// occluders ready costs more than culling with them.
pub fn cull(index: &SceneIndex, view: &View, options: &CullOptions) -> Result<Culling, ViewError> {
    Culler::new().cull(index, view, options)
}

#[cfg(test)]
mod tests;
