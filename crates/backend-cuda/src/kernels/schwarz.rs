//! The preconditioner `schwarz`.

use cloth_core::{LinearOutcome, LinearVector, Result, schwarz::FREE};

use super::{CudaKernels, linear::unsupported, matrix_copy::pairs_copy};
use crate::{
    layout::CudaReal,
    linear,
    queue::{Launch, argument},
    schwarz::SchwarzMemory,
};

const MODULE: &str = "preconditioner_build_schwarz";
/// Threads of a warp, and of blocks as in `preconditioner_build_schwarz.cu`.
const WARP: usize = 32;
const MODES_THREADS: u32 = 32;
const COARSE_THREADS: u32 = 128;

/// S of a particle as it is compared.
fn packed<T: CudaReal>(filters: &[Option<[T; 6]>], particle: u32) -> [f32; 6] {
    filters[particle as usize].map_or(FREE, |filter| filter.map(|entry| entry.to_f64() as f32))
}

impl<T: CudaReal> CudaKernels<T> {
    /// `preconditioner_build` of `schwarz`: anew, for other constraints, or not at all.
    pub(super) fn schwarz_build(&mut self) -> Result<()> {
        self.settle()?;
        self.linear()?;
        let Some(linear) = &mut self.linear else { unreachable!("it was just made") };
        let mut memory = match linear.schwarz.take() {
            Some(memory) => memory,
            None => Box::new(SchwarzMemory::new(&self.memory.queue, &self.model)?),
        };
        let has_constraints = linear.data.has_constraints != 0;
        let built = self.schwarz_update(&mut memory, has_constraints);
        if let Some(linear) = &mut self.linear {
            linear.data.schwarz = memory.address();
            linear.schwarz = Some(memory);
        }
        built
    }

    fn schwarz_update(&mut self, memory: &mut SchwarzMemory, has_constraints: bool) -> Result<()> {
        let is_new = memory.reuse.wants_build();
        if !is_new {
            // Particles are held by command alone otherwise, which a frame begins with.
            if !has_constraints {
                return Ok(());
            }
            let filters = self.filters_read()?;
            if !memory.schwarz.is_outdated(|particle| packed(&filters, particle)) {
                return Ok(());
            }
        }
        self.stage("preconditioner_build", |kernels| {
            let pairs = kernels.contact_pairs_of_groups(memory.schwarz.group_of())?;
            let queue = &kernels.memory.queue;
            let build = memory.build_data(queue, pairs.into_iter())?;
            let groups = memory.group_count();
            kernels.linear()?.data.schwarz = memory.address();
            let more = [argument(&build)];
            let mut start = |name, launch| kernels.linear_start((MODULE, name), launch, &more);
            start("schwarz_diagonals", Launch::over(memory.schwarz.len()))?;
            // Few groups, and much for each thread to do.
            let blocks = (groups as u32).div_ceil(MODES_THREADS);
            let modes = Launch { blocks, threads: MODES_THREADS, shared: 0, cooperative: false };
            start("schwarz_modes", modes)?;
            let blocks = (WARP as u32 * groups as u32).div_ceil(COARSE_THREADS);
            let coarse = Launch { blocks, threads: COARSE_THREADS, shared: 0, cooperative: false };
            start("schwarz_coarse", coarse)
        })?;
        let filters = self.filters_read()?;
        memory.build_above(&self.memory.queue, |particle| packed(&filters, particle))
    }

    /// Pairs of groups that contact couples.
    fn contact_pairs_of_groups(&self, group_of: &[u32]) -> Result<Vec<[u32; 2]>> {
        let mut pairs = Vec::new();
        let Some(linear) = &self.linear else { return Ok(pairs) };
        if let Some(triangles) = self.triangles.as_ref().filter(|_| linear.data.has_contacts != 0) {
            pairs = triangles.set().coupled(|particle| group_of[particle as usize]);
        }
        let mut put = |i: u32, j: u32| {
            let pair = [i, j].map(|particle| group_of[particle as usize]);
            if pair[0] != pair[1] {
                pairs.push(pair);
            }
        };
        if linear.data.has_pairs != 0 {
            let rows = pairs_copy(&self.memory, linear)?;
            for (i, ends) in rows.starts.windows(2).enumerate() {
                let row = &rows.pairs[ends[0] as usize..ends[1] as usize];
                row.iter().for_each(|&(j, ..)| put(i as u32, j));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        Ok(pairs)
    }

    /// `preconditioner_apply` of `schwarz`.
    pub(super) fn schwarz_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        self.settle()?;
        let kernel = ("conjugate_gradient", "preconditioner_apply_schwarz");
        let Some(linear) = &mut self.linear else { return unsupported("a matrix out of nothing") };
        let launch = linear::choose(kernel, &self.memory, &mut self.cache, linear)?;
        self.memory.status.solver_barrier_prepare(&self.memory.queue, launch.blocks)?;
        let (from, to) = (from as u32, to as u32);
        self.stage("preconditioner_apply", |kernels| {
            kernels.linear_start(kernel, launch, &[argument(&from), argument(&to)])
        })
    }

    /// Another frame, substep or state: nothing of before counts.
    pub(super) fn schwarz_forget(&mut self) {
        if let Some(schwarz) = self.linear.as_mut().and_then(|linear| linear.schwarz.as_mut()) {
            schwarz.reuse.forget();
        }
    }

    /// Notes the iterations of a solve.
    pub(super) fn schwarz_solved(&mut self, outcome: &LinearOutcome) {
        let Some(linear) = &mut self.linear else { return };
        let is_schwarz = linear.is_schwarz();
        if let Some(schwarz) = &mut linear.schwarz {
            if is_schwarz {
                schwarz.reuse.solved(outcome.iterations);
            } else if outcome.restarted {
                schwarz.reuse.forget();
            }
        }
    }
}
