//! How much memory the linear systems of the large-step solvers need.
//!
//! What the counts below rest on was measured with patches of 256 x 256 particles, 12 and 24 neighbours,
//! in single precision: `cargo bench -p cloth-benches --bench integrators -- memory`.

use cloth_core::{LinearMethod, MatrixForm, Preconditioner, SemiImplicitSolve};

use crate::{SceneSimulation, SceneSolver};

/// Numbers of a linear system for each particle: the vectors, two kinds of diagonal blocks,
/// constraints, the state kept.
const SYSTEM_NUMBERS: u64 = 52;

/// Numbers for each spring: direction, factor, and where they are.
const FACTOR_NUMBERS: u64 = 5;

/// Numbers for each spring of the matrix as blocks.
const BLOCK_NUMBERS: u64 = 13;

/// Numbers for each spring of the incomplete factorisation, its blocks included.
const INCOMPLETE_NUMBERS: u64 = 50;

/// Entries of a sparse factor for each particle, in units of the binary logarithm of the number of
/// particles: so the fill of a grid grows with nested dissection (George 1973).
const FILL: u64 = 44;

/// Bytes beside the numbers and springs that all solvers have.
pub(super) fn bytes(
    simulation: &SceneSimulation,
    particles: u64,
    springs: u64,
    number: u64,
) -> u64 {
    let numbers = |per_particle: u64, per_spring: u64| {
        let of_springs = springs.saturating_mul(per_spring);
        particles.saturating_mul(per_particle).saturating_add(of_springs).saturating_mul(number)
    };
    let fill = particles.saturating_mul(FILL * u64::from(particles.max(2).ilog2()));
    let system = numbers(SYSTEM_NUMBERS, FACTOR_NUMBERS);
    // The model is not there yet that would choose a solver: the implicit one needs more.
    match simulation.solver_given().unwrap_or(SceneSolver::Implicit) {
        SceneSolver::Explicit => 0,
        SceneSolver::Implicit => {
            let implicit = &simulation.implicit;
            let blocks = if implicit.matrix == MatrixForm::Assembled {
                numbers(0, BLOCK_NUMBERS)
            } else {
                0
            };
            let incomplete = implicit.preconditioner == Preconditioner::IncompleteCholesky;
            let method = match implicit.linear {
                LinearMethod::ConjugateGradient if incomplete => numbers(0, INCOMPLETE_NUMBERS),
                // Blocks of 3 x 3 in double precision.
                LinearMethod::Direct => fill.saturating_mul(9 * 8),
                _ => 0,
            };
            system.saturating_add(blocks).saturating_add(method)
        }
        SceneSolver::SemiImplicit => {
            let factor = match simulation.semi_implicit.solve {
                SemiImplicitSolve::DenseInverse => particles.saturating_mul(particles),
                _ => fill,
            };
            factor.saturating_mul(number)
        }
    }
}
