//! Patches of many faces, laid out for [`mosaic`](super::mosaic): planes sixteen together, corners and edges in
//! sixteen bits.

use super::occluder::{ENDS, Face, Vertices};

/// Patches of fewer faces are not worth it.
const LEAST_FACES: usize = 6;

/// No face: what lies beyond the end of a surface.
const NO_FACE: u16 = u16::MAX;

/// The fine patches of an occluder, one after another.
#[derive(Debug, Default)]
pub(super) struct FineFaces {
    plane: Vec<SixteenPlanes>,
    face: Vec<FineFace>,
}

/// Planes of sixteen faces, `n·p = d`, n on the side of the front: n's coordinates, then d. Each patch is filled up
/// with planes that face nobody.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct SixteenPlanes(pub [[f32; 16]; 4]);

/// A face's corners and neighbours: a quarter of a cache line.
#[derive(Clone, Copy, Debug)]
pub(super) struct FineFace {
    /// Vertices of the patch; of a triangle the last is corner 0 again.
    pub corner: [u16; 4],
    /// The face across the edge from corner k to the next: itself where there is no edge, and the number after the
    /// last where the surface ends.
    pub across: [u16; 4],
}

/// Where a patch lies among the fine faces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fine {
    first: u32,
    two_sided: bool,
}

/// A fine patch.
#[derive(Clone, Copy)]
pub(super) struct FinePatch<'a> {
    pub plane: &'a [SixteenPlanes],
    pub face: &'a [FineFace],
    pub two_sided: bool,
}

impl FineFaces {
    /// Adds a patch, if it has enough faces and not too many, all of the same sides.
    pub fn push(&mut self, faces: &[Face], vertices: &Vertices, first_vertex: u32) -> Option<Fine> {
        let count = vertices.x.len() - first_vertex as usize;
        let room = usize::from(NO_FACE) - 16;
        let alike = faces.iter().all(|f| f.two_sided == faces[0].two_sided);
        if faces.len() < LEAST_FACES || faces.len() > room || count > room || !alike {
            return None;
        }
        let first = self.face.len() as u32;
        let nothing = faces.len().next_multiple_of(16) as u16;
        for (f, face) in faces.iter().enumerate() {
            let plane = plane_of(face, vertices, first_vertex);
            if f % 16 == 0 {
                self.plane.push(SixteenPlanes([[0.0; 16]; 4]));
            }
            if let Some(sixteen) = self.plane.last_mut() {
                sixteen.0.iter_mut().zip(plane).for_each(|(list, v)| list[f % 16] = v);
            }
            let mut across = [f as u16; 4];
            for (to, &other) in across.iter_mut().zip(&face.across[..usize::from(face.corners)]) {
                *to = if other == ENDS { nothing } else { other as u16 };
            }
            self.face.push(FineFace { corner: face.corner.map(|v| v as u16), across });
        }
        while !self.face.len().is_multiple_of(16) {
            self.face.push(FineFace { corner: [0; 4], across: [0; 4] });
        }
        Some(Fine { first, two_sided: faces[0].two_sided })
    }

    /// A patch of `faces` faces.
    #[inline(always)]
    pub fn get(&self, fine: &Fine, faces: u32) -> FinePatch<'_> {
        let all = fine.first as usize..(fine.first + faces.next_multiple_of(16)) as usize;
        FinePatch {
            plane: &self.plane[all.start / 16..all.end / 16],
            face: &self.face[all],
            two_sided: fine.two_sided,
        }
    }

    /// Bytes it holds.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.plane.as_slice()) + size_of_val(self.face.as_slice())
    }
}

/// The plane of a face: by its diagonals, or two sides, the cross product is the normal. Its rounding only decides
/// between front and back where a face is seen edge-on.
pub(super) fn plane_of(face: &Face, vertices: &Vertices, first: u32) -> [f32; 4] {
    let at = |k: usize| {
        let v = (first + face.corner[k]) as usize;
        glam::DVec3::new(vertices.x[v].into(), vertices.y[v].into(), vertices.z[v].into())
    };
    let normal = match face.corners {
        3 => (at(1) - at(0)).cross(at(2) - at(0)),
        _ => (at(2) - at(0)).cross(at(3) - at(1)),
    };
    let normal = normal.normalize_or_zero();
    let middle = (at(0) + at(1) + at(2)) / 3.0;
    [normal.x as f32, normal.y as f32, normal.z as f32, normal.dot(middle) as f32]
}
