//! A scene as a line drawing: exactly the parts of its lines that are seen, as line segments in the plane.
//!
//! [`Preparation::new`] finds the edges of every mesh once; [`Preparation::draw`] makes a [`Drawing`] for a
//! [`View`](crate::conventions::View), and may be called for as many views as one likes. There is no file format here.
//! Both share their work among the threads of the `rayon` pool that they are called in; a drawing does not depend
//! on their number.
//!
//! How a drawing is made:
//! 1. `shown`: instances that may be seen are clipped and projected, nearest first; `cover` notes for each
//!    cell of a grid how far one can see there, and whole instances and triangles beyond that are left out;
//!    so are the backs of `bodies`.
//! 2. `edges`: the edges to draw are chosen by their kind in this view; `junctions` has joined those that meet
//!    part of the way. `intersections` adds the lines in which surfaces meet; `flats` knows crowds of
//!    triangles in one plane, which do not.
//! 3. `trace`: each line is followed through the grid; `hide` finds the exact part that one triangle hides.
//!    Signs that decide are exact ([Shewchuk 1997]); end points are crossings of lines, never samples.
//! 4. `coincident` draws once what lies on one another; `joints` joins the rest into few long strokes, and `strokes`
//!    puts these into an order.
//! 5. If faces are asked for, `regions` cuts the paper along all visible lines, tile by tile, and `faces` finds what
//!    each region shows. `caps` closes what section planes open.
//!
//! What counts: a surface hides what is farther along the line of sight, whichever of its sides is seen.
//! What is nearer to a surface than the *tolerance*, a few units in the last place of a coordinate in `f32` at
//! that place, lies in it and is not hidden by it; so bodies that touch show their lines. An edge is never hidden
//! by the triangles that it is an edge of.
//!
//! Textures are not looked at: a surface is there where its material, without its texture, is not wholly
//! transparent, or below the cutoff of its mask. Holes that a texture makes are drawn solid.

mod arrangement;
mod bodies;
mod caps;
mod coincident;
mod cover;
mod crew;
mod draw;
mod drawing;
mod edges;
mod faces;
mod flats;
mod grid;
mod hatch;
mod hide;
mod intersections;
mod joints;
mod junctions;
mod lens;
mod occluders;
mod predicates;
mod regions;
mod runs;
mod seams;
mod shown;
mod slivers;
mod strokes;
mod topology;
mod trace;
pub mod views;

#[cfg(test)]
mod tests;

pub use drawing::{Counters, Drawing, Face, Kind, Stroke};

use crate::geometry::Aabb;
use crate::scene::Scene;
use crew::Crew;
use glam::{DAffine3, DVec3};
use topology::Topology;

/// The part of a coordinate, as files store it, that is rounding: 2⁻²³, and as much again for sums.
const ROUNDING: f64 = 2.5e-7;

/// Which lines are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kinds {
    /// Where a surface turns away from the eye.
    pub silhouette: bool,
    /// Where a surface bends by at least [`LineOptions::crease_angle`].
    pub crease: bool,
    /// Where a surface ends, or where more than two meet in an edge.
    pub boundary: bool,
    /// Where a mesh's material changes.
    pub border: bool,
    /// Where surfaces pass through each other, of one part or of two.
    pub intersection: bool,
    /// Where an edge of one surface lies on another surface that goes on beyond it.
    pub contact: bool,
    /// Lines of the model ([`Mesh::lines`](crate::scene::Mesh::lines)), and edges that
    /// [`PrepareOptions::marked`] names.
    pub marked: bool,
}

impl Kinds {
    /// All of them.
    pub const ALL: Kinds = Kinds {
        silhouette: true,
        crease: true,
        boundary: true,
        border: true,
        intersection: true,
        contact: true,
        marked: true,
    };
    /// None of them.
    pub const NONE: Kinds = Kinds {
        silhouette: false,
        crease: false,
        boundary: false,
        border: false,
        intersection: false,
        contact: false,
        marked: false,
    };
}

impl Default for Kinds {
    fn default() -> Kinds {
        Kinds::ALL
    }
}

/// What may be chosen about a preparation.
#[derive(Clone, Debug, Default)]
pub struct PrepareOptions {
    /// Edges to draw whatever they are, besides the lines of the model: a mesh and two of its vertices.
    pub marked: Vec<(u32, [u32; 2])>,
}

/// How visible faces are coloured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceColor {
    /// White.
    White,
    /// The material's colour, without its texture.
    Material,
    /// The material's colour, darker where a face turns away from a light above the eye.
    Flat,
}

/// A plane that cuts the scene: what is on the side of its normal is taken away. A closed body that ends in the plane is cut
/// there, and of one that begins in it and is taken away nothing stays; an open sheet in it does. In the plane is what
/// rounding may have put there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// A point of the plane, world space.
    pub point: DVec3,
    /// Towards what is taken away; of any length but zero.
    pub normal: DVec3,
}

/// What may be chosen about a drawing.
#[derive(Clone, Debug)]
pub struct LineOptions {
    /// Which lines.
    pub kinds: Kinds,
    /// From which angle between neighbours' normals on an edge is a crease, radians. At 0 every edge is one
    /// but those between neighbours in a plane.
    pub crease_angle: f64,
    /// Whether hidden lines are wanted, too, with the number of triangles that cover them. Takes longer:
    /// nothing may be left out.
    pub hidden: bool,
    /// Whether blended materials hide what is behind them.
    pub transparent_hides: bool,
    /// Planes that cut the scene.
    pub sections: Vec<SectionPlane>,
    /// Whether visible faces are wanted, too, and in which colour.
    pub faces: Option<FaceColor>,
    /// Distance of lines that fill faces, pixels; the faces are shaded flat for it.
    pub hatch: Option<f64>,
}

impl Default for LineOptions {
    fn default() -> LineOptions {
        LineOptions {
            kinds: Kinds::ALL,
            crease_angle: 30f64.to_radians(),
            hidden: false,
            transparent_hides: true,
            sections: Vec::new(),
            faces: None,
            hatch: None,
        }
    }
}

/// A scene made ready to be drawn from anywhere.
#[derive(Debug)]
pub struct Preparation {
    meshes: Vec<Topology>,
    bounds: Vec<Aabb>,
    instances: Vec<(u32, DAffine3)>,
    tolerance: f64,
}

impl Preparation {
    /// Finds the edges of every mesh. The scene must be valid. Cost in time and memory: the triangles that
    /// are stored, not those that are shown (about 130 bytes each), and the instances.
    pub fn new(scene: &Scene, options: &PrepareOptions) -> Preparation {
        let marked = |mesh: usize| -> Vec<[u32; 2]> {
            options.marked.iter().filter(|m| m.0 as usize == mesh).map(|m| m.1).collect()
        };
        let crew = Crew::here();
        let topology = |i: usize| Topology::of(crew, scene, &scene.meshes[i], &marked(i));
        let meshes = crew.inside(|| crew.map((0..scene.meshes.len()).collect(), topology));
        let bounds = scene.meshes.iter().map(|m| m.bounds().union(&m.bounds_of_lines())).collect();
        let mut preparation = Preparation { meshes, bounds, instances: Vec::new(), tolerance: 0.0 };
        preparation.pose(scene);
        preparation
    }

    /// Takes the instances' places anew from the same scene, after it was posed. Cost: the instances.
    pub fn pose(&mut self, scene: &Scene) {
        self.instances = scene.instances().iter().map(|i| (i.mesh, i.world_from_mesh)).collect();
        let reach = scene.bounds().map_or(1.0, |b| b.min.abs().max(b.max.abs()).max_element());
        self.tolerance = reach * ROUNDING;
    }

    /// The largest distance, metres, at which things are taken to be at the same place: that where the scene's
    /// coordinates are largest. Elsewhere it is as much smaller as the coordinates there are.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }
}
