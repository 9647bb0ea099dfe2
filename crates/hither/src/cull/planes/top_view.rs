//! What a top view of the last look shows, in the manner of the paper's figures 10 and 11.

use super::culler::PlaneCuller;
use super::visible::State;
use crate::geometry::Aabb;
use glam::{DVec2, DVec3};

/// A plan of the scene, seen along −Y: x to the right, z down.
#[derive(Clone, Debug, Default)]
pub struct TopView {
    /// Where the eye is.
    pub eye: DVec2,
    /// Boxes that the last look settled: hidden or visible nodes, leaves, and nodes outside the view.
    pub boxes: Vec<TopViewBox>,
    /// All polygons, by number.
    pub polygons: Vec<TopViewPolygon>,
    /// Outlines of the occluders in use.
    pub occluders: Vec<Vec<DVec2>>,
    /// The cell of the leaf that holds the eye.
    pub leaf: Option<[DVec2; 2]>,
}

/// A node's box.
#[derive(Clone, Debug)]
pub struct TopViewBox {
    /// Least and greatest x and z.
    pub corners: [DVec2; 2],
    /// Its state; [`State::Outside`] is outside the view.
    pub state: State,
}

/// A polygon's outline.
#[derive(Clone, Debug)]
pub struct TopViewPolygon {
    /// Corners.
    pub corners: Vec<DVec2>,
    /// As of [`PlaneCuller::polygon_states`].
    pub state: State,
}

fn plan(p: DVec3) -> DVec2 {
    DVec2::new(p.x, p.z)
}

impl PlaneCuller {
    /// A plan of the last look; empty before the first.
    pub fn top_view(&self) -> TopView {
        let sight = if self.foresaw { &self.future } else { &self.present };
        let eye = sight.frame.eye;
        let mut view = TopView { eye: plan(eye), ..TopView::default() };
        let mut at = 0;
        while let (Some(node), Some(memory)) = (self.tree.nodes.get(at), sight.memories.get(at)) {
            let state = if memory.outside { State::Outside } else { memory.state };
            let settled = state != State::Partial || node.right == 0;
            if settled && !node.bounds.is_empty() {
                view.boxes.push(TopViewBox { corners: flat(&node.bounds), state });
            }
            at = if settled { node.end as usize } else { at + 1 };
        }
        let polygon = |(number, state): (u32, State)| TopViewPolygon {
            corners: self.model.corners(number).map(plan).collect(),
            state,
        };
        view.polygons = (0..).zip(self.polygon_states()).map(polygon).collect();
        view.occluders = sight.frame.active.iter().map(|active| self.outline(active.id / 2)).collect();
        view.leaf = self.tree.leaf_of(eye).map(|leaf| flat(&self.tree.nodes[leaf as usize].cell));
        view
    }

    fn outline(&self, occluder: u32) -> Vec<DVec2> {
        let (first, end) = self.occluders.all[occluder as usize].sides;
        let sides = &self.occluders.sides[first as usize..end as usize];
        sides.iter().map(|s| plan(self.occluders.vertices[s.from as usize])).collect()
    }
}

fn flat(b: &Aabb) -> [DVec2; 2] {
    [plan(b.min), plan(b.max)]
}
