//! The rungs below the product: a launch or a few for each substep, one thread for each particle.

use cloth::{Divergence, DivergenceCause, DivergenceOrigin, Error, Result, State};
use cudarc::driver::{CudaFunction, CudaSlice, DevicePtr, PushKernelArg};

use super::{
    LadderRun, Rung,
    device::Device,
    single_thread::{particles, state_of},
    workload::{Constants, Particle, SUBSTEPS},
};

/// Particles that a bin has room for at first, and at most.
const CAPACITY: [u32; 2] = [32, 1 << 12];

/// Runs frames, again with larger bins if some were too small.
///
/// # Errors
/// `Overflow`, `Diverged`, and what the device reports.
pub(super) fn run(
    device: &Device,
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

/// Where bins are in device memory, as the struct `Bins` of `ladder.cuh` has it: counts, entries, places, overflow.
type BinAddresses = [u64; 4];

/// The bins of two substeps, which take turns.
struct BinMemory {
    counts: [CudaSlice<u32>; 2],
    entries: [CudaSlice<u32>; 2],
    places: CudaSlice<u32>,
    overflow: CudaSlice<u32>,
    present: usize,
    /// Whether the bins of the substep before are there.
    is_filled: bool,
}

impl BinMemory {
    fn new(device: &Device, constants: &Constants) -> Result<Self> {
        let count = constants.bin_count();
        let entries = count * constants.bin_capacity as usize;
        Ok(Self {
            counts: [device.zeros(count)?, device.zeros(count)?],
            entries: [device.zeros(entries)?, device.zeros(entries)?],
            places: device.zeros(constants.count as usize)?,
            overflow: device.zeros(1)?,
            present: 0,
            is_filled: false,
        })
    }

    fn addresses(&self, device: &Device, which: usize) -> BinAddresses {
        [&self.counts[which], &self.entries[which], &self.places, &self.overflow]
            .map(|array| array.device_ptr(&device.stream).0)
    }
}

/// A rung at work.
struct Stepper<'a> {
    device: &'a Device,
    rung: Rung,
    constants: Constants,
    /// The same in device memory, for the rung that reads them there.
    constants_stored: CudaSlice<Constants>,
    particles: [CudaSlice<Particle>; 2],
    bins: Option<BinMemory>,
    /// The kernel of a substep.
    step: &'a CudaFunction,
}

impl<'a> Stepper<'a> {
    fn new(device: &'a Device, rung: Rung, constants: Constants, state: &State) -> Result<Self> {
        let kernels = &device.kernels;
        let (step, has_bins) = match rung {
            Rung::Naive => (&kernels.naive, false),
            Rung::Constants => (&kernels.constants, false),
            Rung::Math | Rung::Swap => (&kernels.math, false),
            Rung::Bins | Rung::Neighbours | Rung::Ours => (&kernels.bins, true),
        };
        let start = particles(&constants, state);
        Ok(Self {
            constants_stored: device.array(&[constants])?,
            particles: [device.array(&start)?, device.array(&start)?],
            bins: if has_bins { Some(BinMemory::new(device, &constants)?) } else { None },
            device,
            rung,
            constants,
            step,
        })
    }

    /// Seconds that the device took for a frame.
    fn frame(&mut self) -> Result<f64> {
        let start = self.device.mark()?;
        for _ in 0..SUBSTEPS {
            self.bins_update()?;
            self.substep()?;
        }
        let end = self.device.mark()?;
        self.device.seconds(&start, &end)
    }

    /// Puts the present particles into bins.
    fn bins_update(&mut self) -> Result<()> {
        let Some(bins) = &mut self.bins else { return Ok(()) };
        let (device, constants) = (self.device, &self.constants);
        let from_last = bins.is_filled && self.rung == Rung::Neighbours;
        let last = bins.addresses(device, bins.present);
        bins.present = 1 - bins.present;
        bins.is_filled = true;
        let present = bins.addresses(device, bins.present);
        let mut place = device.stream.launch_builder(&device.kernels.bins_place);
        place.arg(constants).arg(&present).arg(&self.particles[0]);
        device.launch(&mut place, constants.count as usize)?;
        let mut fill = if from_last {
            let mut refill = device.stream.launch_builder(&device.kernels.bins_refill);
            refill.arg(constants).arg(&last);
            refill
        } else {
            let mut fill = device.stream.launch_builder(&device.kernels.bins_fill);
            fill.arg(constants);
            fill
        };
        device.launch(fill.arg(&present), constants.bin_count())
    }

    /// From `particles[0]` to `particles[1]`, and back.
    fn substep(&mut self) -> Result<()> {
        let device = self.device;
        let bins = self.bins.as_ref().map(|bins| bins.addresses(device, bins.present));
        let [old, new] = &mut self.particles;
        let mut step = device.stream.launch_builder(self.step);
        match self.rung {
            Rung::Naive => step.arg(&self.constants_stored),
            _ => step.arg(&self.constants),
        };
        if let Some(bins) = &bins {
            step.arg(bins);
        }
        step.arg(&*old).arg(&mut *new);
        device.launch(&mut step, self.constants.count as usize)?;
        match self.rung {
            Rung::Naive | Rung::Constants | Rung::Math => device.copy(new, old),
            _ => {
                std::mem::swap(old, new);
                Ok(())
            }
        }
    }

    /// The particles that some bin should have held, if it was too small.
    fn overflow(&self) -> Result<Option<u32>> {
        let Some(bins) = &self.bins else { return Ok(None) };
        let overflow = self.device.read(&bins.overflow)?;
        Ok(overflow.first().copied().filter(|&needed| needed > 0))
    }

    fn state_read(&self, frames: usize, state: &mut State) -> Result<()> {
        state_of(&self.device.read(&self.particles[0])?, frames, state);
        Ok(())
    }

    /// `LimitExceeded` if some particle is in no bin.
    fn lost_check(&self) -> Result<()> {
        let Some(bins) = &self.bins else { return Ok(()) };
        let counts = self.device.read(&bins.counts[bins.present])?;
        let entries = self.device.read(&bins.entries[bins.present])?;
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
