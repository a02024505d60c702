//! Triangles and their rows by particle.

use cloth_core::Model;

/// The tables of `shared/air.cuh` and `vertex_normals.cu`.
#[derive(Debug)]
pub(crate) struct TriangleTables {
    /// Where the triangles of each particle start, length n + 1.
    pub(crate) rows: Vec<u32>,
    /// The triangles of each particle, ascending: corners and cloth. Who gathers from them reads one after the other.
    pub(crate) triangles: Vec<[u32; 4]>,
}

impl TriangleTables {
    pub(crate) fn new(model: &Model) -> Self {
        let mut rows = vec![0_u32; model.particle_count() + 1];
        for &vertex in model.triangles().iter().flatten() {
            rows[vertex as usize + 1] += 1;
        }
        for i in 0..model.particle_count() {
            rows[i + 1] += rows[i];
        }
        let mut next = rows.clone();
        let mut triangles = vec![[0; 4]; 3 * model.triangles().len()];
        for (number, cloth) in model.cloths().iter().enumerate() {
            for t in cloth.triangles.clone() {
                let [a, b, c] = model.triangles()[t as usize];
                for vertex in [a, b, c] {
                    let slot = &mut next[vertex as usize];
                    triangles[*slot as usize] = [a, b, c, number as u32];
                    *slot += 1;
                }
            }
        }
        Self { rows, triangles }
    }
}
