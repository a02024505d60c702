//! Irregular triangle meshes.

use cloth_core::TriangleMesh;

use crate::random::Random;

/// A sheet of `columns` x `rows` cells of size `spacing` \[m\] in the plane z = 0: vertices moved at
/// random, each cell divided along either diagonal, every eighth triangle missing if `holes`.
#[must_use]
pub fn irregular_mesh(
    [columns, rows]: [u32; 2],
    spacing: f64,
    holes: bool,
    random: &mut Random,
) -> TriangleMesh {
    let mut positions = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let [dx, dy, dz] = random.vector(0.2 * spacing);
            let [x, y] = [column, row].map(|index| f64::from(index) * spacing);
            positions.push([x + dx, y + dy, dz]);
        }
    }
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
            let pair =
                if random.chance(0.5) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            triangles.extend(pair.into_iter().filter(|_| !(holes && random.chance(0.125))));
        }
    }
    if triangles.is_empty() {
        triangles.push([0, 1, columns + 1]);
    }
    without_isolated_vertices(&positions, &triangles)
}

/// Drops the vertices that no triangle uses: they would have no mass.
fn without_isolated_vertices(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> TriangleMesh {
    let mut is_used = vec![false; positions.len()];
    triangles.iter().flatten().for_each(|&vertex| is_used[vertex as usize] = true);
    let mut new_index = vec![0; positions.len()];
    let mut mesh = TriangleMesh::default();
    for (vertex, &position) in positions.iter().enumerate().filter(|&(vertex, _)| is_used[vertex]) {
        new_index[vertex] = mesh.positions.len() as u32;
        mesh.positions.push(position);
    }
    mesh.triangles = triangles.iter().map(|t| t.map(|vertex| new_index[vertex as usize])).collect();
    mesh
}
