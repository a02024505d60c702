//! NUMERICS §6, `semi_implicit_solve`.

use cloth_core::{FabricMatrix, Model};

use crate::{Particles, Vector, sparse_cholesky::SparseCholesky};

/// y with W y = h f + h^2 sum k (v_j - v_i), zero for held particles.
pub(crate) fn semi_implicit_solve(
    model: &Model,
    particles: &Particles<f64>,
    forces: &[Vector<f64>],
    length: f64,
    factors: &SparseCholesky,
) -> Vec<Vector<f64>> {
    let mut sums = vec![Vector::ZERO; particles.len()];
    for spring in model.springs().iter() {
        let stiffness = model.springs().kinds()[spring.kind as usize].stiffness;
        let [i, j] = spring.particles.map(|particle| particle as usize);
        let pull = (particles.velocities[j] - particles.velocities[i]).scaled(stiffness);
        sums[i] += pull;
        sums[j] -= pull;
    }
    if model.has_fabric() {
        let fabric = FabricMatrix::constant(model);
        for (i, sum) in sums.iter_mut().enumerate() {
            let entries = &fabric.entries()[fabric.row(i)];
            for (&j, entry) in fabric.neighbours().row(i).iter().zip(entries) {
                let difference = particles.velocities[j as usize] - particles.velocities[i];
                *sum -= difference.scaled(entry.stiffness);
            }
        }
    }
    let right_side: Vec<[f64; 3]> = (0..particles.len())
        .map(|i| {
            let b = forces[i].scaled(length) + sums[i].scaled(length * length);
            if particles.is_held(i) { [0.0; 3] } else { b.0 }
        })
        .collect();
    factors.solve(&right_side).into_iter().map(Vector).collect()
}
