//! A mesh made searchable: its triangles in blocks of sixteen, and trees over the blocks.

use super::parts::Primitive;
use super::tree::{Box3, WideTree};
use super::{IndexOptions, TreeKind};
use super::{bvh, octree};
use crate::raster::TriangleBlock;
use crate::scene::{AlphaMode, Material, Mesh};
use glam::Vec3;
use rayon::prelude::*;

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
                let corners = corners(mesh, t);
                if has_area(&corners) {
                    let [a, b, c] = corners;
                    list.push(Primitive::new(a.min(b).min(c), a.max(b).max(c), t));
                }
            }
        }
        // Blended triangles are never shared by leaves: each tints once.
        let unshared =
            if options.tree == TreeKind::OctreePushed { TreeKind::OctreeSmallest } else { options.tree };
        MeshIndex {
            solid: build_blocks(mesh, materials, solid, options.tree),
            blended: build_blocks(mesh, materials, blended, unshared),
        }
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

    /// Asserts that the trees are sound and that every triangle that can be seen lies in one leaf, or, where
    /// small ones are pushed down, in several.
    pub fn validate(&self, mesh: &Mesh, options: &IndexOptions) {
        let mut leaves = vec![0; mesh.triangles.len()];
        for t in [&self.solid, &self.blended] {
            t.tree.validate(t.blocks.len(), |leaf| block_bounds(&t.blocks[leaf]));
            for block in &t.blocks {
                let lanes = (0..16).filter(|l| block.lanes >> l & 1 == 1);
                for (triangle, found) in lanes.map(|l| (block.triangle[l], block.corners(l))) {
                    let stored = corners(mesh, triangle).map(|p| p.to_array());
                    assert_eq!(found, stored, "triangle {triangle} is misplaced");
                    leaves[triangle as usize] += 1;
                }
            }
        }
        for (triangle, &count) in leaves.iter().enumerate() {
            let expected = usize::from(has_area(&corners(mesh, triangle as u32)));
            let shared = options.tree == TreeKind::OctreePushed && expected == 1;
            assert!(count == expected || (shared && count > 1), "triangle {triangle} lies in {count} leaves");
        }
    }
}

/// Whether corners differ. Without area no pixel centre is covered, whatever the view.
#[inline(always)]
fn has_area([a, b, c]: &[Vec3; 3]) -> bool {
    a != b && b != c && c != a
}

#[inline(always)]
fn corners(mesh: &Mesh, triangle: u32) -> [Vec3; 3] {
    mesh.triangles[triangle as usize].map(|v| mesh.positions[v as usize])
}

fn build_blocks(
    mesh: &Mesh,
    materials: &[Material],
    mut primitives: Vec<Primitive>,
    tree: TreeKind,
) -> BlockTree {
    let built = match tree {
        TreeKind::Bvh => bvh::build(&mut primitives, 16),
        TreeKind::OctreeSmallest => octree::build_smallest(primitives, 16),
        TreeKind::OctreePushed => octree::build_pushed(primitives, 16, |t| corners(mesh, t)),
    };
    let blocks = built
        .leaf_start
        .par_windows(2)
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
