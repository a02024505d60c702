//! NUMERICS §9: vertex normals.

use cloth_core::Model;

use super::Particles;
use crate::tracked::TrackedVector;

/// Area-weighted unit normals; zero where the sum is.
pub fn vertex_normals(
    model: &Model,
    particles: &mut Particles,
    epsilon: f64,
) -> Vec<TrackedVector> {
    let mut sums = vec![TrackedVector::ZERO; particles.len()];
    for corners in model.triangles() {
        let corners = corners.map(|corner| corner as usize);
        let [a, b, c] = corners.map(|corner| particles.positions[corner]);
        for corner in corners {
            sums[corner] += (b - a).cross(c - a);
        }
    }
    for (sum, uncertain) in sums.iter_mut().zip(&mut particles.uncertain) {
        let length = sum.length();
        // A sum that is zero but for rounding can point anywhere.
        *uncertain |= length.error > 0.0 && length.is_close(super::ZERO, epsilon);
        if length.value > 0.0 {
            *sum = sum.divided(length);
        }
    }
    sums
}
