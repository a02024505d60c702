//! The historical ladder: the explicit step with self-contact, done in the ways in which it was done before.
//!
//! Each [`Rung`] changes one thing of the rung below it, so that a table of their times says what each change is
//! worth. All of them, and [`single_thread`] on the CPU, which is the base of the table, compute the same: a square patch that falls onto
//! a sphere, twelve springs to a particle, a penalty force between all particles closer than 16 mm, 34 substeps in a
//! frame of a thirtieth of a second. They agree but for rounding, as they add forces up in different orders.
//!
//! Nothing of the product uses this module; only [`Rung::Ours`] is the product itself.

mod compile;
mod device;
mod single_thread;
mod stepper;
mod table;
mod workload;

use std::sync::Arc;

use cloth::{
    Backend, Error, Frame, Result, State,
    cuda::{CudaBackend, CudaOptions},
};

pub use compile::kernels_compile;
pub use single_thread::single_thread;
pub use table::{
    LADDER_PUBLISHED, LADDER_SIDES, LadderRow, LadderTime, ladder_heading, ladder_line, ladder_row,
};
pub use workload::{FRAME, SIDE_MAX, SUBSTEPS, config, model};

use device::Device;

/// A way to do the step on a GPU, from the plainest to the product.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rung {
    /// An array of structs, constants in device memory, every particle compared with every other by a root and three
    /// divisions, the new state copied over the old one.
    Naive,
    /// Constants in constant memory.
    Constants,
    /// Squares of distances compared before roots are taken, a reciprocal in place of divisions.
    Math,
    /// Two states that take turns in place of the copy.
    Swap,
    /// Contacts looked for in 27 bins; each bin filled by looking at all particles.
    Bins,
    /// Each bin filled from the 27 bins around it of the substep before.
    Neighbours,
    /// The backend `cuda`.
    Ours,
}

impl Rung {
    /// All rungs, from the lowest.
    pub const ALL: [Self; 7] = [
        Self::Naive,
        Self::Constants,
        Self::Math,
        Self::Swap,
        Self::Bins,
        Self::Neighbours,
        Self::Ours,
    ];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Naive => "naive",
            Self::Constants => "constants",
            Self::Math => "math",
            Self::Swap => "swap",
            Self::Bins => "bins",
            Self::Neighbours => "neighbours",
            Self::Ours => "ours",
        }
    }
}

/// What a run gave.
#[derive(Clone, Debug, PartialEq)]
pub struct LadderRun {
    /// State at the end; velocities of single precision, as all of it is computed in it.
    pub state: State,
    /// Time of each frame \[s\]: of the device, between events around it, or of the processor.
    pub frame_seconds: Vec<f64>,
}

/// A GPU to run rungs on.
pub struct Ladder {
    backend: CudaBackend,
    /// For the rungs below it.
    device: Device,
}

impl Ladder {
    /// On the GPU that the options name; their other settings hold for [`Rung::Ours`] alone.
    ///
    /// # Errors
    /// [`Error::NoDevice`] without a driver, GPU or compiler, and what the device reports.
    pub fn new(options: CudaOptions) -> Result<Self> {
        // First the backend, which says what is missing: the package `cudarc` panics without a driver.
        let backend = CudaBackend::new(options)?;
        Ok(Self { backend, device: Device::open(options.device)? })
    }

    /// Some frames of a patch of `side` x `side` particles from its initial state.
    ///
    /// # Errors
    /// Those of [`Self::run_from`].
    pub fn run(&self, rung: Rung, side: u32, frames: usize) -> Result<LadderRun> {
        self.run_from(rung, side, &model(side)?.initial_state(), frames)
    }

    /// The same from another state.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the side is below two or the state is not of this patch, [`Error::LimitExceeded`] above
    /// [`SIDE_MAX`] or if a particle is so fast that [`Rung::Neighbours`] loses it, `Overflow` if more particles
    /// than any bin can hold meet in one, `Diverged`, and what the device reports.
    pub fn run_from(
        &self,
        rung: Rung,
        side: u32,
        state: &State,
        frames: usize,
    ) -> Result<LadderRun> {
        let model = Arc::new(model(side)?);
        state.validate(&model)?;
        if rung != Rung::Ours {
            return stepper::run(&self.device, rung, side, state, frames);
        }
        let mut solver = self.backend.create_solver(model, &config())?;
        solver.upload(state)?;
        let mut run = LadderRun { state: state.clone(), frame_seconds: Vec::with_capacity(frames) };
        for _ in 0..frames {
            solver.advance(Frame { duration: FRAME })?;
            let report = solver.synchronize()?;
            // It looks at the state, which no other rung does.
            let stages = report.stage_times.iter().filter(|stage| stage.stage != "measure");
            run.frame_seconds.push(stages.map(|stage| stage.time.as_secs_f64()).sum());
        }
        solver.download(&mut run.state)?;
        Ok(run)
    }
}

/// `LimitExceeded` for a patch above [`SIDE_MAX`].
fn side_check(side: u32) -> Result<()> {
    if side <= SIDE_MAX {
        return Ok(());
    }
    let limit = "particles along a side of the ladder";
    Err(Error::LimitExceeded { limit, requested: side.into(), max: SIDE_MAX.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_without_a_gpu_gets_an_error() {
        let options = CudaOptions { device: 4096, ..CudaOptions::default() };
        assert!(matches!(Ladder::new(options), Err(Error::NoDevice { .. })));
    }

    #[test]
    fn sides_are_checked_before_anything_is_computed() {
        assert!(matches!(single_thread(1, &State::default(), 1), Err(Error::Invalid(_))));
        let [Err(large), Err(other)] = [
            single_thread(SIDE_MAX + 1, &State::default(), 1),
            single_thread(6, &model(5).unwrap().initial_state(), 1),
        ] else {
            panic!("both are wrong");
        };
        assert!(matches!(large, Error::LimitExceeded { .. }));
        assert!(matches!(other, Error::Invalid(_)));
    }
}
