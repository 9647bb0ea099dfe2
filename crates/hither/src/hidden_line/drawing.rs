//! What a drawing consists of.

use super::arrangement;
use glam::DVec2;
use std::ops::Range;

/// Why a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// The outline of a cut by a section plane.
    Section,
    /// Where a surface ends, or more than two meet.
    Boundary,
    /// Where a surface turns away from the eye.
    Silhouette,
    /// Where a surface bends.
    Crease,
    /// Where surfaces pass through each other.
    Intersection,
    /// Where an edge lies on another surface.
    Contact,
    /// Where a material ends.
    Border,
    /// A line of the model, or an edge that the user marked.
    Marked,
    /// Filling of a face.
    Hatch,
}

impl Kind {
    /// Every kind, in the order in which one that lies on another is preferred.
    pub const ALL: [Kind; 9] = [
        Kind::Section,
        Kind::Boundary,
        Kind::Silhouette,
        Kind::Crease,
        Kind::Intersection,
        Kind::Contact,
        Kind::Border,
        Kind::Marked,
        Kind::Hatch,
    ];

    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Section => "section",
            Kind::Boundary => "boundary",
            Kind::Silhouette => "silhouette",
            Kind::Crease => "crease",
            Kind::Intersection => "intersection",
            Kind::Contact => "contact",
            Kind::Border => "border",
            Kind::Marked => "marked",
            Kind::Hatch => "hatch",
        }
    }
}

/// A run of line segments that a pen draws without being lifted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stroke {
    /// The instance that it belongs to; of an intersection, the one with the smaller number.
    pub part: u32,
    /// Why it is drawn.
    pub kind: Kind,
    /// How many triangles cover it; 0 is visible.
    pub covers: u32,
    /// Its points, in [`Drawing::points`]; at least two. A closed stroke ends with its first point.
    pub points: Range<u32>,
}

/// A visible region of one flat face, as a polygon with holes.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The instance that it belongs to: the one that hides what is behind, or, where there is none but blended
    /// surfaces that do not, the farthest of these.
    pub part: u32,
    /// The instances of the blended surfaces that it is seen through, the nearest first.
    pub through: Vec<u32>,
    /// A triangle of the instance's mesh in whose plane it is; of a cut `u32::MAX`.
    pub triangle: u32,
    /// Whether it is where a section plane cuts.
    pub cut: bool,
    /// sRGB, tinted by what it is seen through.
    pub color: [u8; 3],
    /// 1, but for blended surfaces with nothing behind them.
    pub opacity: f32,
    /// The outline and then the holes, pixels, +y down; closed, without repeating the first point.
    pub contours: Vec<Vec<DVec2>>,
}

impl Face {
    /// Its colour on white paper, sRGB.
    pub fn color_on_white(&self) -> [u8; 3] {
        self.color.map(|c| (255.0 - self.opacity * (255.0 - f32::from(c))).round() as u8)
    }

    /// Area without the holes, square pixels.
    pub fn area(&self) -> f64 {
        arrangement::area(&self.contours)
    }

    /// The face as triangles, for what cannot fill polygons with holes.
    pub fn triangles(&self) -> Vec<[DVec2; 3]> {
        arrangement::triangles(&self.contours)
    }
}

/// What was done for a drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Instances that were left out: outside the picture, or wholly hidden.
    pub instances_culled: u64,
    /// Triangles of the other instances.
    pub triangles: u64,
    /// Of these, left in for exact tests.
    pub triangles_live: u64,
    /// Edges and intersections that were followed to be drawn; not those that only bound faces.
    pub lines: u64,
    /// Exact tests of a line against a triangle, also of lines that only bound faces.
    pub tests: u64,
    /// Pairs of triangles that were looked at for a line in which they meet, as often as they share a cell.
    pub pairs: u64,
    /// Line segments before joining.
    pub segments: u64,
    /// Of these, visible.
    pub visible_segments: u64,
}

/// A line drawing.
#[derive(Clone, Debug, Default)]
pub struct Drawing {
    /// Width of the paper, pixels.
    pub width: f64,
    /// Height of the paper, pixels.
    pub height: f64,
    /// Points of all strokes, pixels, +y down.
    pub points: Vec<DVec2>,
    /// What to draw, grouped by part, then visible before hidden, then by kind; within a group in an order
    /// with short ways between strokes.
    pub strokes: Vec<Stroke>,
    /// Visible faces, by part; empty where they were not asked for.
    pub faces: Vec<Face>,
    /// What was done.
    pub counters: Counters,
}

impl Drawing {
    /// The points of a stroke.
    pub fn points_of(&self, stroke: &Stroke) -> &[DVec2] {
        &self.points[stroke.points.start as usize..stroke.points.end as usize]
    }

    /// Total length of what is visible, pixels.
    pub fn visible_length(&self) -> f64 {
        let visible = self.strokes.iter().filter(|s| s.covers == 0);
        visible.flat_map(|s| self.points_of(s).windows(2)).map(|p| p[0].distance(p[1])).sum()
    }
}
