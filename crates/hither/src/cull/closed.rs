//! Whether triangles close: what has an inside does, and nothing else is asked.

/// Whether every edge is walked as often one way as the other, so that each point off the surface has a winding
/// number. Cost: n log n.
pub(super) fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let sides = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
    let mut edges: Vec<(u32, u32, bool)> =
        triangles.iter().flat_map(sides).map(|(a, b)| (a.min(b), a.max(b), a < b)).collect();
    edges.retain(|e| e.0 != e.1);
    edges.sort_unstable();
    edges.chunk_by(|e, f| (e.0, e.1) == (f.0, f.1)).all(|run| 2 * run.partition_point(|e| !e.2) == run.len())
}
