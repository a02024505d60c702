//! How much memory the linear systems of the large-step solvers need.
//!
//! `memory` says how the counts below were measured.

use cloth_core::{LinearMethod, MatrixForm, Preconditioner, SemiImplicitSolve};

use crate::{SceneSimulation, SceneSolver};

/// Numbers of a linear system for each particle: the vectors, two kinds of diagonal blocks,
/// constraints, the state kept.
const SYSTEM_NUMBERS: u64 = 42;

/// Numbers for each spring: direction, factor, and where they are.
const FACTOR_NUMBERS: u64 = 2;

/// Numbers for each spring of the matrix as blocks.
const BLOCK_NUMBERS: u64 = 12;

/// Numbers for each spring of the incomplete factorisation, its blocks included.
const INCOMPLETE_NUMBERS: u64 = 40;

/// Numbers in single precision for each particle of the preconditioner `schwarz`: prolongation twice, and in double precision what particles are moved by
/// and the levels above.
const SCHWARZ_NUMBERS: u64 = 124;

/// Entries of the sparse factor of the constant matrix, in thirds, for each particle and for each spring, in units of the binary
/// logarithm of the number of particles: so the fill of a grid grows with nested dissection (George 1973).
const FILL: [u64; 2] = [39, 1];

/// The same of the direct solver, in halves, whose entries are blocks.
const BLOCK_FILL: [u64; 2] = [16, 1];

/// Bytes beside the numbers and springs that all solvers have, for particles, springs, and whether there is fabric.
pub(super) fn bytes(
    simulation: &SceneSimulation,
    (particles, springs, has_fabric): (u64, u64, bool),
    number: u64,
) -> u64 {
    let numbers = |per_particle: u64, per_spring: u64| {
        let of_springs = springs.saturating_mul(per_spring);
        particles.saturating_mul(per_particle).saturating_add(of_springs).saturating_mul(number)
    };
    let growth = (particles.max(2) as f64).log2();
    let fill = |[particle, spring]: [u64; 2], parts: f64| {
        let entries = particles.saturating_mul(particle) + springs.saturating_mul(spring);
        (entries as f64 * growth / parts) as u64
    };
    let system = numbers(SYSTEM_NUMBERS, FACTOR_NUMBERS);
    // The model is not there yet that would choose a solver: the implicit one needs more.
    match simulation.solver_given().unwrap_or(SceneSolver::Implicit) {
        SceneSolver::Explicit => 0,
        SceneSolver::Implicit | SceneSolver::Midpoint => {
            let implicit = &simulation.implicit;
            let blocks = if implicit.matrix == MatrixForm::Assembled {
                numbers(0, BLOCK_NUMBERS)
            } else {
                0
            };
            let incomplete = implicit.preconditioner == Preconditioner::IncompleteCholesky;
            let schwarz = match implicit.preconditioner {
                Preconditioner::Schwarz => true,
                Preconditioner::Auto => has_fabric,
                _ => false,
            };
            let method = match implicit.linear {
                LinearMethod::ConjugateGradient if incomplete => numbers(0, INCOMPLETE_NUMBERS),
                LinearMethod::ConjugateGradient if schwarz => {
                    particles.saturating_mul(SCHWARZ_NUMBERS).saturating_mul(4)
                }
                // Blocks of 3 x 3 in double precision.
                LinearMethod::Direct => fill(BLOCK_FILL, 2.0).saturating_mul(9 * 8),
                _ => 0,
            };
            system.saturating_add(blocks).saturating_add(method)
        }
        SceneSolver::SemiImplicit => {
            // It is computed in double precision, and kept in that of the solver.
            let factor = fill(FILL, 3.0);
            let kept = match simulation.semi_implicit.solve {
                SemiImplicitSolve::DenseInverse => particles.saturating_mul(particles),
                _ => factor,
            };
            kept.saturating_mul(number).saturating_add(factor.saturating_mul(8))
        }
    }
}
