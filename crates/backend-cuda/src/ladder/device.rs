//! The rungs below the product on a GPU: a launch or a few for each substep, one thread for each particle.

use std::{ffi::c_void, sync::Arc};

use cloth_core::{Divergence, DivergenceCause, DivergenceOrigin, Error, Result, State};
use cloth_kernels::CudaModule;

use super::{
    LadderRun, Rung,
    single_thread::{particles, state_of},
    workload::{Constants, Particle, SUBSTEPS},
};
use crate::{
    compile::Target,
    device::{Device, Kernel},
    queue::{Buffer, Launch, Queue, argument},
    timing::Timing,
};

/// Particles that a bin has room for at first, and at most.
const CAPACITY: [u32; 2] = [32, 1 << 12];

/// Runs frames, again with larger bins if some were too small.
///
/// # Errors
/// `Overflow`, `Diverged`, and what the device reports.
pub(super) fn run(
    device: &Arc<Device>,
    rung: Rung,
    side: u32,
    state: &State,
    frames: usize,
) -> Result<LadderRun> {
    let [mut capacity, most] = CAPACITY;
    loop {
        let constants = Constants::new(side, capacity);
        let mut stepper = Stepper::new(device, rung, constants, state)?;
        let mut run = LadderRun { state: state.clone(), frame_seconds: Vec::with_capacity(frames) };
        for _ in 0..frames {
            run.frame_seconds.push(stepper.frame()?);
        }
        let Some(needed) = stepper.overflow()? else {
            stepper.state_read(frames, &mut run.state)?;
            finite_check(&run.state, constants.length)?;
            stepper.lost_check()?;
            return Ok(run);
        };
        if needed > most {
            let [needed, capacity] = [needed, most].map(u64::from);
            return Err(Error::Overflow { buffer: "bins of the ladder", needed, capacity });
        }
        capacity = needed.next_power_of_two();
    }
}

/// `Diverged` for the first particle with a number that is not finite.
fn finite_check(state: &State, time_step: f32) -> Result<()> {
    let is_finite = |vector: &[f64; 3]| vector.iter().all(|component| component.is_finite());
    let mut both = state.positions.iter().zip(&state.velocities);
    let Some(particle) = both.position(|(x, v)| !is_finite(x) || !is_finite(v)) else {
        return Ok(());
    };
    Err(Error::Diverged(Divergence {
        step: state.step,
        time: state.time,
        particle: particle as u32,
        cause: DivergenceCause::NonFinite,
        time_step: f64::from(time_step),
        stable_time_step: None,
        origin: DivergenceOrigin::Unknown,
    }))
}

/// Bins, as `ladder.cuh` lays them out.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
struct BinData {
    counts: u64,
    entries: u64,
    places: u64,
    overflow: u64,
}

/// The bins of two substeps, which take turns.
struct BinMemory {
    counts: [Buffer<u32>; 2],
    entries: [Buffer<u32>; 2],
    places: Buffer<u32>,
    overflow: Buffer<u32>,
    present: usize,
    /// Whether the bins of the substep before are there.
    is_filled: bool,
}

impl BinMemory {
    fn new(queue: &Queue, constants: &Constants) -> Result<Self> {
        let count = constants.bin_count();
        let entries = count * constants.bin_capacity as usize;
        Ok(Self {
            counts: [Buffer::zeros(queue, count)?, Buffer::zeros(queue, count)?],
            entries: [Buffer::zeros(queue, entries)?, Buffer::zeros(queue, entries)?],
            places: Buffer::zeros(queue, constants.count as usize)?,
            overflow: Buffer::zeros(queue, 1)?,
            present: 0,
            is_filled: false,
        })
    }

    fn data(&self, which: usize) -> BinData {
        BinData {
            counts: self.counts[which].address(),
            entries: self.entries[which].address(),
            places: self.places.address(),
            overflow: self.overflow.address(),
        }
    }
}

/// A rung at work. Fields are dropped in order: the queue, which waits for the device, first.
struct Stepper {
    queue: Queue,
    timing: Timing,
    rung: Rung,
    constants: Constants,
    /// The same in device memory, for the rung that reads them there.
    constants_stored: Buffer<Constants>,
    particles: [Buffer<Particle>; 2],
    bins: Option<BinMemory>,
    kernels: Kernels,
}

/// Kernels of a rung.
struct Kernels {
    step: Kernel,
    /// Places, fill, refill.
    bins: Option<[Kernel; 3]>,
}

impl Stepper {
    fn new(device: &Arc<Device>, rung: Rung, constants: Constants, state: &State) -> Result<Self> {
        let queue = Queue::new(Arc::clone(device))?;
        let has_bins = matches!(rung, Rung::Bins | Rung::Neighbours);
        let module = match rung {
            Rung::Naive => "ladder_naive",
            Rung::Constants => "ladder_constants",
            Rung::Math | Rung::Swap => "ladder_math",
            Rung::Bins | Rung::Neighbours | Rung::Ours => "ladder_bins",
        };
        let Some(module) = CudaModule::find(module) else {
            let log = "there is no module of this name".to_owned();
            return Err(Error::KernelCompile { kernel: module, log });
        };
        let target = Target { double: false, fast: false, options: &[], procedural: None };
        let kernel = |name| device.kernel(module, &target, name);
        let kernels = Kernels {
            step: kernel("step")?,
            bins: if has_bins {
                Some([kernel("bins_place")?, kernel("bins_fill")?, kernel("bins_refill")?])
            } else {
                None
            },
        };
        let start = particles(&constants, state);
        Ok(Self {
            constants_stored: Buffer::of(&queue, &[constants])?,
            particles: [Buffer::of(&queue, &start)?, Buffer::of(&queue, &start)?],
            bins: if has_bins { Some(BinMemory::new(&queue, &constants)?) } else { None },
            timing: Timing::default(),
            queue,
            rung,
            constants,
            kernels,
        })
    }

    fn launch(&self, kernel: Kernel, items: usize, mut arguments: Vec<*mut c_void>) -> Result<()> {
        // SAFETY: each caller gives the arguments of its kernel; all memory is owned by this, which waits for its
        // queue before any of it is freed.
        unsafe { self.queue.launch(kernel, Launch::over(items), &mut arguments) }
    }

    /// Seconds that the device took for a frame.
    fn frame(&mut self) -> Result<f64> {
        let start = self.timing.begin(&self.queue)?;
        for _ in 0..SUBSTEPS {
            self.bins_update()?;
            self.substep()?;
        }
        self.timing.end(&self.queue, "frame", start)?;
        // It forgets errors, which this reports.
        self.queue.synchronize()?;
        Ok(self.timing.take(&self.queue).iter().map(|stage| stage.time.as_secs_f64()).sum())
    }

    /// Puts the present particles into bins.
    fn bins_update(&mut self) -> Result<()> {
        let (Some(bins), Some([place, fill, refill])) = (&mut self.bins, self.kernels.bins) else {
            return Ok(());
        };
        let from_last = bins.is_filled && self.rung == Rung::Neighbours;
        let last = bins.data(bins.present);
        bins.present = 1 - bins.present;
        bins.is_filled = true;
        let data = bins.data(bins.present);
        let constants = &self.constants;
        let address = self.particles[0].address();
        let arguments = vec![argument(constants), argument(&data), argument(&address)];
        self.launch(place, constants.count as usize, arguments)?;
        let (kernel, arguments) = if from_last {
            (refill, vec![argument(constants), argument(&last), argument(&data)])
        } else {
            (fill, vec![argument(constants), argument(&data)])
        };
        self.launch(kernel, constants.bin_count(), arguments)
    }

    /// From `particles[0]` to `particles[1]`, and back.
    fn substep(&mut self) -> Result<()> {
        let [from, to] = self.particles.each_ref().map(Buffer::address);
        let stored = self.constants_stored.address();
        let bins = self.bins.as_ref().map(|bins| bins.data(bins.present));
        let mut arguments = match self.rung {
            Rung::Naive => vec![argument(&stored)],
            _ => vec![argument(&self.constants)],
        };
        arguments.extend(bins.as_ref().map(argument));
        arguments.extend([argument(&from), argument(&to)]);
        self.launch(self.kernels.step, self.constants.count as usize, arguments)?;
        let [old, new] = &mut self.particles;
        match self.rung {
            Rung::Naive | Rung::Constants | Rung::Math => old.copy_from(&self.queue, new),
            _ => {
                std::mem::swap(old, new);
                Ok(())
            }
        }
    }

    /// The particles that some bin should have held, if it was too small.
    fn overflow(&self) -> Result<Option<u32>> {
        let Some(bins) = &self.bins else { return Ok(None) };
        let mut overflow = Vec::new();
        bins.overflow.read(&self.queue, &mut overflow)?;
        Ok(overflow.first().copied().filter(|&needed| needed > 0))
    }

    fn state_read(&self, frames: usize, state: &mut State) -> Result<()> {
        let mut particles = Vec::new();
        self.particles[0].read(&self.queue, &mut particles)?;
        state_of(&particles, frames, state);
        Ok(())
    }

    /// `LimitExceeded` if some particle is in no bin.
    fn lost_check(&self) -> Result<()> {
        let Some(bins) = &self.bins else { return Ok(()) };
        let (mut counts, mut entries) = (Vec::new(), Vec::new());
        bins.counts[bins.present].read(&self.queue, &mut counts)?;
        bins.entries[bins.present].read(&self.queue, &mut entries)?;
        let mut is_found = vec![!bins.is_filled; self.constants.count as usize];
        let rows = entries.chunks_exact(self.constants.bin_capacity as usize);
        for (row, &count) in rows.zip(&counts) {
            for &particle in &row[..count as usize] {
                is_found[particle as usize] = true;
            }
        }
        if is_found.contains(&false) {
            let limit = "bins that a particle of the rung `neighbours` goes in a substep";
            return Err(Error::LimitExceeded { limit, requested: 2, max: 1 });
        }
        Ok(())
    }
}
