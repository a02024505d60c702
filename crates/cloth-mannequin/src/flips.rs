//! Edges that are exchanged for better ones.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

/// Fewest triangles around a vertex.
const AROUND_MIN: u32 = 3;

/// Flips each edge whose two opposite angles are more than half a turn together, as Delaunay (1934) wants, where that leaves the mesh a manifold
/// and folds nothing over. Of triangles that touch one is changed at most; call it again for more.
pub(crate) fn flip(positions: &[DVec3], triangles: &mut [[u32; 3]]) {
    let mut owners = HashMap::new();
    let mut around = vec![0_u32; positions.len()];
    for (number, &[a, b, c]) in triangles.iter().enumerate() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            owners.insert((from, to), number);
            around[from as usize] += 1;
        }
    }
    let mut is_changed = vec![false; triangles.len()];
    let mut made = HashSet::new();
    for number in 0..triangles.len() {
        for k in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|j| triangles[number][(k + j) % 3]);
            let Some(&twin) = owners.get(&(b, a)) else { continue };
            if is_changed[number] || is_changed[twin] {
                continue;
            }
            let Some(&d) = triangles[twin].iter().find(|&&vertex| vertex != a && vertex != b)
            else {
                continue;
            };
            let is_edge = owners.contains_key(&(c, d)) || owners.contains_key(&(d, c));
            let few = around[a as usize] <= AROUND_MIN || around[b as usize] <= AROUND_MIN;
            let pair = (c.min(d), c.max(d));
            if is_edge || few || made.contains(&pair) || !is_better(positions, [a, b, c, d]) {
                continue;
            }
            triangles[number] = [a, d, c];
            triangles[twin] = [d, b, c];
            made.insert(pair);
            for (vertex, change) in [(a, -1), (b, -1), (c, 1), (d, 1)] {
                around[vertex as usize] = around[vertex as usize].saturating_add_signed(change);
            }
            [is_changed[number], is_changed[twin]] = [true, true];
        }
    }
}

/// Whether c-d is a better edge than a-b, of triangles a b c and b a d.
fn is_better(positions: &[DVec3], vertices: [u32; 4]) -> bool {
    let [a, b, c, d] = vertices.map(|vertex| positions[vertex as usize]);
    let cotangent = |at: DVec3| (a - at).dot(b - at) / (a - at).cross(b - at).length().max(1e-15);
    let normal = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a);
    let before = normal(a, b, c).normalize_or_zero() + normal(b, a, d).normalize_or_zero();
    let stays = |made: DVec3| made.normalize_or_zero().dot(before) > 1.0;
    cotangent(c) + cotangent(d) < -1e-6 && stays(normal(a, d, c)) && stays(normal(d, b, c))
}
