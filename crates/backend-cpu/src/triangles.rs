//! The triangles around each particle.

use cloth_core::Model;

/// Row i holds the triangles of particle i, ascending.
#[derive(Clone, Debug)]
pub(crate) struct TriangleRows {
    offsets: Vec<u32>,
    triangles: Vec<u32>,
}

impl TriangleRows {
    pub(crate) fn new(model: &Model) -> Self {
        let mut offsets = vec![0_u32; model.particle_count() + 1];
        for &vertex in model.triangles().iter().flatten() {
            offsets[vertex as usize + 1] += 1;
        }
        for i in 0..model.particle_count() {
            offsets[i + 1] += offsets[i];
        }
        let mut next = offsets.clone();
        let mut triangles = vec![0; 3 * model.triangles().len()];
        for (t, triangle) in model.triangles().iter().enumerate() {
            for &vertex in triangle {
                let slot = &mut next[vertex as usize];
                triangles[*slot as usize] = t as u32;
                *slot += 1;
            }
        }
        Self { offsets, triangles }
    }

    /// The triangles of a particle.
    pub(crate) fn row(&self, particle: usize) -> &[u32] {
        &self.triangles[self.offsets[particle] as usize..self.offsets[particle + 1] as usize]
    }
}
