//! Vertex normals.

use glam::DVec3;

/// Unit normal at every vertex, the mean of the adjacent triangles weighted by area; zero where
/// there is no triangle. `positions` in metres; triangles with indices out of range are skipped.
#[must_use]
pub fn vertex_normals(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[f64; 3]> {
    let mut normals = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let corner = |index: u32| positions.get(index as usize).copied().map(DVec3::from);
        let [a, b, c] = triangle.map(corner);
        let (Some(a), Some(b), Some(c)) = (a, b, c) else {
            continue;
        };
        // The length of the product is twice the area, which is the weight.
        let normal = (b - a).cross(c - a);
        for &index in triangle {
            normals[index as usize] += normal;
        }
    }
    normals.into_iter().map(|normal| normal.normalize_or_zero().to_array()).collect()
}
