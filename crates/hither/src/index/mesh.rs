//! A mesh made searchable: its triangles in blocks of sixteen, and trees over the blocks.

use super::bvh::{self, Primitive};
use super::octree;
use super::tree::{Box3, WideTree};
use super::{IndexOptions, TreeKind};
use crate::raster::TriangleBlock;
use crate::scene::{AlphaMode, Material, Mesh};
use glam::Vec3;

/// A tree whose leaves are blocks of triangles.
#[derive(Debug, Default)]
pub(crate) struct BlockTree {
    pub tree: WideTree,
    pub blocks: Vec<TriangleBlock>,
}

/// A mesh's surfaces: those that hide (opaque, or with an alpha mask), and those that only tint.
#[derive(Debug, Default)]
pub(crate) struct MeshIndex {
    pub solid: BlockTree,
    pub blended: BlockTree,
}

impl MeshIndex {
    pub fn build(mesh: &Mesh, materials: &[Material], options: &IndexOptions) -> MeshIndex {
        let mut solid = Vec::with_capacity(mesh.triangles.len());
        let mut blended = Vec::new();
        for run in &mesh.primitives {
            let material = run.material.map(|m| &materials[m as usize]);
            let blends = material.is_some_and(|m| m.alpha == AlphaMode::Blend);
            let list = if blends { &mut blended } else { &mut solid };
            for t in run.triangles.clone() {
                let [a, b, c] = corners(mesh, t);
                // Without area no pixel centre is covered, whatever the view.
                if a == b || b == c || c == a {
                    continue;
                }
                let (min, max) = (a.min(b).min(c), a.max(b).max(c));
                let bounds = Box3 { min: min.to_array(), max: max.to_array() };
                list.push(Primitive { bounds, index: t });
            }
        }
        let tree = |list: &mut Vec<Primitive>| build_blocks(mesh, materials, list, options);
        MeshIndex { solid: tree(&mut solid), blended: tree(&mut blended) }
    }

    pub fn bounds(&self) -> Box3 {
        self.solid.tree.bounds().union(&self.blended.tree.bounds())
    }

    pub fn memory_bytes(&self) -> usize {
        [&self.solid, &self.blended]
            .map(|t| size_of_val(t.tree.nodes.as_slice()) + size_of_val(t.blocks.as_slice()))
            .iter()
            .sum()
    }

    pub fn validate(&self, options: &IndexOptions) {
        for t in [&self.solid, &self.blended] {
            let shared = options.tree == TreeKind::OctreePushed;
            t.tree.validate(t.blocks.len(), shared, |leaf| block_bounds(&t.blocks[leaf]));
        }
    }
}

fn corners(mesh: &Mesh, triangle: u32) -> [Vec3; 3] {
    mesh.triangles[triangle as usize].map(|v| mesh.positions[v as usize])
}

fn build_blocks(
    mesh: &Mesh,
    materials: &[Material],
    primitives: &mut [Primitive],
    options: &IndexOptions,
) -> BlockTree {
    let built = match options.tree {
        TreeKind::Bvh => bvh::build(primitives, 16),
        TreeKind::OctreeSmallest => octree::build(primitives, false, |t| corners(mesh, t)),
        TreeKind::OctreePushed => octree::build(primitives, true, |t| corners(mesh, t)),
    };
    let blocks = built
        .leaf_start
        .windows(2)
        .map(|range| block(mesh, materials, &built.order[range[0] as usize..range[1] as usize]))
        .collect();
    BlockTree { tree: built.tree, blocks }
}

fn block(mesh: &Mesh, materials: &[Material], triangles: &[u32]) -> TriangleBlock {
    let mut block = TriangleBlock::EMPTY;
    for (lane, &t) in triangles.iter().enumerate() {
        for (k, p) in corners(mesh, t).into_iter().enumerate() {
            for axis in 0..3 {
                block.corner[k][axis][lane] = p[axis];
            }
        }
        block.triangle[lane] = t;
        let bit = 1 << lane;
        block.lanes |= bit;
        if let Some(m) = mesh.material_of(t) {
            let material = &materials[m as usize];
            block.two_sided |= if material.double_sided { bit } else { 0 };
            block.masked |= if matches!(material.alpha, AlphaMode::Mask { .. }) { bit } else { 0 };
        }
    }
    block
}

fn block_bounds(block: &TriangleBlock) -> Box3 {
    (0..16)
        .filter(|l| block.lanes & (1 << l) != 0)
        .flat_map(|l| block.corners(l))
        .fold(Box3::EMPTY, |b, p| b.union(&Box3 { min: p, max: p }))
}
