//! The workload of implicit steps: a patch that hangs from two corners, each particle joined to all 24
//! of its neighbours in the 5 x 5 block.

use std::{num::NonZeroUsize, sync::Arc};

use cloth::{
    Backend, Cloth, Frame, Geometry, Integrator, Mass, MaterialPreset, Model, ModelBuilder,
    ModelError, NetworkSpring, Precision, Result, SolverConfig, SpringClass, SpringCoefficients,
    SpringNetwork, State, Stencil,
};

use crate::RunningWorkload;

/// Length of a step, which is a frame \[s\].
pub const HANG_STEP: f64 = 1.0 / 60.0;

/// Distance of neighbouring particles \[m\].
const SPACING: f64 = 0.02;

/// Stiffness of a spring along the threads \[N/m\]; longer ones are softer by their length.
const STIFFNESS: f64 = 10.0;

/// Damping of every spring \[N s/m\].
const DAMPING: f64 = 0.005;

/// Mass of a particle \[kg\].
const MASS: f64 = 1e-4;

/// One size of the workload.
#[derive(Clone, Copy, Debug)]
pub struct HangWorkload {
    /// Particles along the edge that hangs from its ends.
    pub side: u32,
    /// Rows of particles below each other; as many as `side` in the square that most tables use.
    pub rows: u32,
    /// Length of a step, which is a frame \[s\].
    pub time_step: f64,
    /// Precision of the solver.
    pub precision: Precision,
    /// Threads, or all there are.
    pub threads: Option<NonZeroUsize>,
}

impl HangWorkload {
    /// A square in f32 on all threads, in steps of [`HANG_STEP`].
    #[must_use]
    pub const fn new(side: u32) -> Self {
        let (precision, threads) = (Precision::F32, None);
        Self { side, rows: side, time_step: HANG_STEP, precision, threads }
    }

    /// Number of particles.
    #[must_use]
    pub fn particles(&self) -> u64 {
        u64::from(self.side) * u64::from(self.rows)
    }

    /// The model. Stiffness goes with one over the length of a spring, five values in all, more than
    /// a patch has classes: a network has a stiffness for each spring.
    ///
    /// # Errors
    /// For a side of less than two particles.
    pub fn model(&self) -> Result<Arc<Model>, ModelError> {
        let [side, rows] = [self.side, self.rows].map(i64::from);
        let place = |column: i64, row: i64| (row * side + column) as u32;
        let mut network = SpringNetwork::default();
        for row in 0..rows {
            for column in 0..side {
                network.positions.push([column as f64 * SPACING, row as f64 * SPACING, 0.0]);
                for &([across, up], class) in Stencil::Neighbours24.upper_offsets() {
                    let [i, j] = [column + i64::from(across), row + i64::from(up)];
                    if (0..side).contains(&i) && (0..rows).contains(&j) {
                        network.springs.push(spring(
                            [place(column, row), place(i, j)],
                            class,
                            f64::from(across).hypot(f64::from(up)),
                        ));
                    }
                }
            }
        }
        let mut material = MaterialPreset::ALL[0].material(SPACING);
        material.mass = Mass::PerParticle(MASS);
        let cloth = Cloth {
            name: "patch".into(),
            geometry: Geometry::Network(network),
            material: material.into(),
            pins: vec![0, self.side.saturating_sub(1)],
            velocity: [0.0; 3],
        };
        ModelBuilder::new().cloth(cloth).build().map(Arc::new)
    }

    /// Settings for this integrator.
    #[must_use]
    pub fn config(&self, integrator: Integrator) -> SolverConfig {
        SolverConfig {
            precision: self.precision,
            time_step: self.time_step,
            integrator,
            threads: self.threads,
            // The weight stretches the springs to many times their length: that is no divergence.
            strain_bound: 1e6,
            ..SolverConfig::default()
        }
    }

    /// A solver that has done `before` steps.
    ///
    /// # Errors
    /// What the backend reports.
    pub fn start(
        &self,
        backend: &dyn Backend,
        integrator: Integrator,
        before: usize,
    ) -> Result<RunningWorkload> {
        let solver = backend.create_solver(self.model()?, &self.config(integrator))?;
        RunningWorkload::new(solver, Frame { duration: self.time_step }, before)
    }

    /// Mean of |l/L - 1| over the springs along the threads.
    #[must_use]
    pub fn strain_mean(&self, state: &State) -> f64 {
        let [side, rows] = [self.side, self.rows].map(|count| count as usize);
        let length = |a: usize, b: usize| {
            let [a, b] = [state.positions[a], state.positions[b]];
            (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt()
        };
        let mut sum = 0.0;
        let mut count = 0_u32;
        for row in 0..rows {
            for column in 0..side {
                let here = row * side + column;
                for (inside, there) in
                    [(column + 1 < side, here + 1), (row + 1 < rows, here + side)]
                {
                    if inside {
                        sum += (length(here, there) / SPACING - 1.0).abs();
                        count += 1;
                    }
                }
            }
        }
        sum / f64::from(count.max(1))
    }
}

/// A spring across `offset` spacings.
fn spring(particles: [u32; 2], class: SpringClass, offset: f64) -> NetworkSpring {
    NetworkSpring {
        particles,
        class,
        // Not the distance of the positions, whose rounding would make every spring one of its kind.
        rest_length: Some(offset * SPACING),
        coefficients: Some(SpringCoefficients { stiffness: STIFFNESS / offset, damping: DAMPING }),
    }
}
