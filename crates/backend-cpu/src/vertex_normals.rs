//! NUMERICS §9: vertex normals.

use cloth_core::{Model, Real};
use rayon::prelude::*;

use crate::{
    memory::VectorField,
    triangles::TriangleRows,
    vector::{cross, dot, sub},
};

/// Normal of every particle.
pub(crate) fn run<T: Real>(
    model: &Model,
    rows: &TriangleRows,
    position: &VectorField<T>,
    out: &mut Vec<[f64; 3]>,
) {
    (0..model.particle_count())
        .into_par_iter()
        .with_min_len(1024)
        .map(|particle| {
            let mut sum = [T::ZERO; 3];
            for &triangle in rows.row(particle) {
                let corners = model.triangles()[triangle as usize];
                let [a, b, c] = corners.map(|vertex| position.get(vertex as usize));
                let normal = cross(sub(b, a), sub(c, a));
                for axis in 0..3 {
                    sum[axis] += normal[axis];
                }
            }
            let length = dot(sum, sum).sqrt();
            let inverse = if length > T::ZERO { T::ONE / length } else { T::ZERO };
            sum.map(|component| (component * inverse).to_f64())
        })
        .collect_into_vec(out);
}
