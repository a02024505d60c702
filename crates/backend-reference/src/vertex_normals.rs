//! NUMERICS §9, `vertex_normals`.

use cloth_core::Model;

use crate::{Number, Particles, Vector};

/// Area-weighted unit normals; zero where the sum is.
pub fn vertex_normals<N: Number>(model: &Model, particles: &mut Particles<N>) -> Vec<Vector<N>> {
    let mut sums = vec![Vector::ZERO; particles.len()];
    for corners in model.triangles() {
        let corners = corners.map(|corner| corner as usize);
        let [a, b, c] = corners.map(|corner| particles.positions[corner]);
        for corner in corners {
            sums[corner] += (b - a).cross(c - a);
        }
    }
    for (i, sum) in sums.iter_mut().enumerate() {
        let length = sum.length();
        // A sum that is zero but for rounding can point anywhere.
        if length != N::ZERO {
            particles.doubt([i], length, N::ZERO);
        }
        if length.value() > 0.0 {
            *sum = sum.divided(length);
        }
    }
    sums
}
