//! Which of its forms the kernel of the linear solvers takes for a model.

use cloth_core::{Error, Result};

use crate::{
    fault::BACKEND,
    layout::{CudaReal, Real4},
    linear::LinearMemory,
    memory::{BLOCK, Memory},
    queue::Launch,
};

/// Springs of a particle, blocks of sums, and places of a window that the resident form has room for, as in
/// `shared/resident.cuh`.
const RESIDENT_SPRINGS: u32 = 24;
const RESIDENT_BLOCKS: usize = 96;
const RESIDENT_PLACES: usize = 1 << 16;
/// Entries of shared memory for a tile, as in `conjugate_gradient_patch.cu`: origins and vectors of 32 by 16 particles and two
/// around them on all sides.
const PATCH_ENTRIES: usize = 2 * 36 * 20;
/// Teams of a block that each work on a block of unknowns of `schwarz`, and bytes of shared memory of one, as in `shared/schwarz.cuh`.
pub(crate) const TEAMS: usize = 4;
const TEAM_MEMORY: usize = 4 * 5376 + 2 * 8 * 96;
/// Particles up to which the general form gains from many registers, and not from many threads.
const REGISTERS_PARTICLES_MAX: usize = 1 << 17;

/// A form of the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SolverForm {
    /// For every model.
    General,
    /// The same with as many registers as there are.
    ManyRegisters,
    /// For large patches of 24 neighbours, tile by tile.
    Patch,
    /// Every particle in the registers of a thread of its own for the whole solve.
    Resident,
    /// For every model, with the preconditioner `schwarz`.
    Schwarz,
}

/// What a solve asks for, of which not every form has everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct SolveNeeds {
    /// Pairs or triangles in contact.
    pub(crate) contact: bool,
    /// The preconditioner `schwarz`.
    pub(crate) schwarz: bool,
    /// An estimate of the error in the norm of the energy.
    pub(crate) energy: bool,
}

impl SolverForm {
    /// The module of the kernel.
    pub(crate) const fn module(self) -> &'static str {
        match self {
            Self::General | Self::ManyRegisters | Self::Resident | Self::Schwarz => {
                "conjugate_gradient"
            }
            Self::Patch => "conjugate_gradient_patch",
        }
    }

    /// The option that the kernel is compiled with.
    pub(crate) const fn option(self) -> Option<&'static str> {
        match self {
            Self::General | Self::Patch => None,
            Self::ManyRegisters => Some("many_registers"),
            Self::Resident => Some("resident"),
            Self::Schwarz => Some("schwarz"),
        }
    }

    /// Threads of a block.
    const fn threads(self) -> usize {
        match self {
            Self::General | Self::ManyRegisters | Self::Schwarz => BLOCK,
            Self::Patch | Self::Resident => BLOCK / 2,
        }
    }

    /// The launch of kernel `name` in this form, if the model, the precision and the device are such that the present system
    /// can be solved in it.
    fn launch<T: CudaReal>(
        self,
        name: &'static str,
        memory: &mut Memory<T>,
        linear: &LinearMemory<T>,
        needs: SolveNeeds,
    ) -> Result<Option<Launch>> {
        if needs.schwarz != (self == Self::Schwarz)
            || needs.energy && matches!(self, Self::Patch | Self::Resident)
        {
            return Ok(None);
        }
        let n = memory.data.count as usize;
        let is_resident = self == Self::Resident;
        // Particles of a block, and all that their neighbours can be.
        let places = self.threads() + 2 * linear.data.reach as usize;
        let is_possible = !T::DOUBLE
            && !linear.has_contact()
            && linear.elements.is_none()
            && memory.springs.longest_row() <= RESIDENT_SPRINGS
            && n.div_ceil(BLOCK) <= RESIDENT_BLOCKS
            && places <= RESIDENT_PLACES;
        if is_resident && !is_possible {
            return Ok(None);
        }
        if self == Self::Patch
            && (T::DOUBLE
                || linear.elements.is_some()
                || linear.data.has_contacts != 0
                || !linear.is_patch()
                || n < REGISTERS_PARTICLES_MAX)
        {
            return Ok(None);
        }
        memory.solver = self;
        let kernel = memory.kernel(self.module(), name)?;
        let device = &memory.queue.device;
        let shared = match self {
            Self::General | Self::ManyRegisters => 0,
            Self::Schwarz => TEAMS * (TEAM_MEMORY + 96 * size_of::<T>()),
            Self::Patch => PATCH_ENTRIES * size_of::<Real4<T>>(),
            Self::Resident => places * size_of::<Real4<T>>(),
        };
        if shared > device.shared_left(kernel)? {
            return Ok(None);
        }
        let threads = self.threads() as u32;
        let resident = device.resident_blocks(kernel, threads, shared)?;
        let mut wanted = (n as u32).div_ceil(threads);
        if self == Self::Schwarz {
            wanted = wanted.max(linear.schwarz.as_ref().map_or(1, |all| all.blocks_wanted()));
        }
        if is_resident && resident < wanted {
            return Ok(None);
        }
        Ok(Some(Launch { blocks: resident.min(wanted), threads, shared, cooperative: true }))
    }

    /// The form that is fastest for the present system, as that of `memory` from now on, and its launch.
    pub(crate) fn choose<T: CudaReal>(
        name: &'static str,
        memory: &mut Memory<T>,
        linear: &mut LinearMemory<T>,
        energy: bool,
    ) -> Result<Launch> {
        let needs =
            SolveNeeds { contact: linear.has_contact(), schwarz: linear.is_schwarz(), energy };
        let key = (name, needs);
        if let Some(&(form, launch)) = linear.launches.get(&key) {
            memory.solver = form;
            return Ok(launch);
        }
        let general = if (memory.data.count as usize) < REGISTERS_PARTICLES_MAX {
            Self::ManyRegisters
        } else {
            Self::General
        };
        for form in [Self::Resident, Self::Patch, Self::Schwarz, general] {
            if let Some(launch) = form.launch(name, memory, linear, needs)? {
                if form == Self::Resident {
                    linear.exchange_prepare(memory)?;
                }
                linear.launches.insert(key, (form, launch));
                return Ok(launch);
            }
        }
        let feature = "the preconditioner schwarz on a GPU with so little shared memory".into();
        Err(Error::Unsupported { backend: BACKEND, feature })
    }
}
