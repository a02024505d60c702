//! The stages of the semi-implicit integrator: its constant system is solved by the conjugate gradient method, in
//! the kernels of the implicit one.

use cloth_core::{
    Divergence, DivergenceCause, DivergenceOrigin, Error, FabricMatrix, ImplicitKernels,
    LinearMethod, LinearSettings, LinearStart, LinearStop, LinearVector, MatrixForm, Model,
    ModelError, PieceBlocks, Preconditioner, Result, SemiImplicitKernels, SemiImplicitSolve,
    SolverReport, stepper::Substep,
};

use super::{CudaKernels, linear};
use crate::{
    layout::CudaReal,
    queue::{Buffer, Launch, Queue, argument},
};

/// Iterations of a solve at most.
const ITERATIONS_MAX: u32 = 4000;
/// Lengths that differ by less than this share of them differ by rounding: that of the last substep of a frame is
/// what is left of it.
const SAME_LENGTH: f64 = 1e-9;
/// Threads of the kernel that sums, and of the one that adds sums up.
const SUM_THREADS: u32 = 256;
const TURN_THREADS: u32 = 32;
/// Sums of a block of particles, and numbers of the rotation of a piece.
const SUMS: usize = 16;
const TURN: usize = 9;

/// How the system is solved: as far as the precision allows.
fn settings<T: CudaReal>() -> LinearSettings {
    let epsilon = if T::DOUBLE { f64::EPSILON } else { f64::from(f32::EPSILON) };
    LinearSettings {
        method: LinearMethod::ConjugateGradient,
        preconditioner: Preconditioner::Diagonal,
        matrix: MatrixForm::MatrixFree,
        stop: LinearStop::Residual,
        tolerance: 0.5 * epsilon,
        iterations_max: ITERATIONS_MAX,
        warm_start: true,
    }
}

/// `Unsupported` for a way to solve that this backend does not have.
pub(super) fn check_solve(solve: SemiImplicitSolve) -> Result<()> {
    match solve {
        SemiImplicitSolve::Factorisation => Ok(()),
        other => linear::unsupported(format!(
            "the {other} of the semi-implicit integrator (it iterates)"
        )),
    }
}

/// What is known of the constant system.
pub(super) struct SemiImplicit<T> {
    /// Length of the substeps that the matrix is for \[s\].
    pub(super) length: Option<f64>,
    /// Particles held at present.
    held: Vec<bool>,
    pieces: Option<Vec<Vec<u32>>>,
    /// The free ones of them, for the particles held at present.
    free: Option<FreePieces>,
    /// What triangles of fabric add, and its stiffness on the device.
    fabric: Option<(FabricMatrix, Buffer<T>)>,
    /// What solves did since the last report.
    pub(super) report: SolverReport,
}

impl<T> Default for SemiImplicit<T> {
    fn default() -> Self {
        Self {
            length: None,
            held: Vec::new(),
            pieces: None,
            free: None,
            fabric: None,
            report: SolverReport::default(),
        }
    }
}

impl<T> SemiImplicit<T> {
    /// Takes note of all particles.
    pub(super) fn held_set(&mut self, held: &[u8]) {
        let held: Vec<bool> = held.iter().map(|&held| held != 0).collect();
        if self.held != held {
            self.held = held;
            self.held_changed();
        }
    }

    /// Whether each particle is held.
    pub(super) fn held(&self) -> &[bool] {
        &self.held
    }

    /// Takes note of one.
    pub(super) fn held_write(&mut self, particle: u32, held: bool) {
        let before = self.held.get_mut(particle as usize);
        if before.is_some_and(|before| std::mem::replace(before, held) != held) {
            self.held_changed();
        }
    }

    fn held_changed(&mut self) {
        self.length = None;
        self.free = None;
    }
}

/// Pieces on the device. The buffers are held by `data` through their addresses.
struct FreePieces {
    data: PieceData,
    pieces: u32,
    blocks: u32,
    _tables: [Buffer<u32>; 4],
    _sums: [Buffer<f64>; 2],
}

/// As `torque_correct.cu` lays it out.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
struct PieceData {
    rows: u64,
    blocks: u64,
    particles: u64,
    piece_of: u64,
    sums: u64,
    turns: u64,
}

impl FreePieces {
    fn new(queue: &Queue, tables: &PieceBlocks) -> Result<Self> {
        let table = |entries: &[u32]| Buffer::of(queue, entries);
        let tables_held = [
            table(bytemuck::cast_slice(&tables.rows))?,
            table(bytemuck::cast_slice(&tables.blocks))?,
            table(&tables.particles)?,
            table(&tables.piece_of)?,
        ];
        let sums_held = [
            Buffer::zeros(queue, tables.blocks.len() * SUMS)?,
            Buffer::zeros(queue, tables.rows.len() * TURN)?,
        ];
        let [rows, blocks, particles, piece_of] = tables_held.each_ref().map(Buffer::address);
        let [sums, turns] = sums_held.each_ref().map(Buffer::address);
        Ok(Self {
            data: PieceData { rows, blocks, particles, piece_of, sums, turns },
            pieces: tables.rows.len() as u32,
            blocks: tables.blocks.len() as u32,
            _tables: tables_held,
            _sums: sums_held,
        })
    }
}

/// `NonFinite` if the entries of the constant matrix for substeps of `length` \[s\] are beyond the precision, by a
/// bound: the weight of the stiffest spring, for as many springs as the model has, and the largest one of fabric.
fn check_matrix<T: CudaReal>(
    model: &Model,
    fabric: Option<&FabricMatrix>,
    length: f64,
) -> Result<()> {
    let weight = |stiffness: f64, damping: f64| length * length * stiffness + length * damping;
    let kinds = model.springs().kinds().iter();
    let largest = kinds.map(|kind| weight(kind.stiffness, kind.damping)).fold(0.0, f64::max);
    let of_fabric = fabric.map_or(0.0, |fabric| fabric.weight_max(length));
    let value = largest * model.springs().len() as f64 + of_fabric;
    if T::from_f64(value).to_f64().is_finite() {
        return Ok(());
    }
    let what = format!("an entry of the constant matrix for a substep of {length} s");
    Err(Error::Invalid(ModelError::NonFinite { what, value }))
}

impl<T: CudaReal> CudaKernels<T> {
    /// Solves the constant system, and once more from the residual computed anew, as the one that an iteration
    /// carries along drifts away from it by rounding.
    fn constant_solve(&mut self, substep: &Substep) -> Result<()> {
        let settings = settings::<T>();
        // From the change of velocity of the substep before.
        let start = match substep.index {
            0 => LinearStart::Constraints,
            _ => LinearStart::Solution,
        };
        let mut outcome = self.conjugate_gradient(&settings, start)?;
        let mut iterations = outcome.iterations;
        if !outcome.breakdown {
            outcome = self.conjugate_gradient(&settings, LinearStart::Solution)?;
            iterations += outcome.iterations;
        }
        let report = &mut self.semi_implicit.report;
        report.iterations += u64::from(iterations);
        if outcome.breakdown {
            return self.constant_solve_failed(substep);
        }
        report.residual = report.residual.max(outcome.residual);
        report.solves_unconverged += u32::from(outcome.iterations == ITERATIONS_MAX);
        Ok(())
    }

    /// `Diverged`, or, if forces are not finite, a change of velocity that shows where.
    fn constant_solve_failed(&mut self, substep: &Substep) -> Result<()> {
        let mut right_side = Vec::new();
        self.vector_read(LinearVector::RightSide, &mut right_side)?;
        if right_side.iter().flatten().any(|component| !component.is_finite()) {
            let [from, to] = [LinearVector::RightSide, LinearVector::Solution];
            return self.vector_combine((1.0, from), (0.0, to));
        }
        Err(Error::Diverged(Divergence {
            step: substep.step,
            time: substep.time + substep.length,
            particle: 0,
            cause: DivergenceCause::LinearSolver,
            time_step: substep.length,
            // A limit of the explicit scheme says nothing here.
            stable_time_step: None,
            origin: DivergenceOrigin::Unknown,
        }))
    }

    /// Puts the stiffness of triangles of fabric on the device, if there are any.
    fn fabric_prepare(&mut self) -> Result<()> {
        if self.semi_implicit.fabric.is_some() || !self.model.has_fabric() {
            return Ok(());
        }
        let fabric = FabricMatrix::constant(&self.model);
        let linear = self.linear()?;
        let Some(elements) = &linear.elements else { return Ok(()) };
        let stiffness = elements.constant_stiffness(&fabric);
        let buffer = Buffer::of(&self.memory.queue, &stiffness)?;
        self.semi_implicit.fabric = Some((fabric, buffer));
        Ok(())
    }

    /// Writes what triangles of fabric add to the matrix of substeps of `length` \[s\].
    fn constant_write(&mut self, fabric: Option<&FabricMatrix>, length: f64) -> Result<()> {
        check_matrix::<T>(&self.model, fabric, length)?;
        let Some(fabric) = fabric else { return Ok(()) };
        self.linear()?;
        let (queue, linear) = (&self.memory.queue, &mut self.linear);
        match linear.as_mut().and_then(|linear| linear.elements.as_mut()) {
            Some(elements) => elements.constant_write(queue, fabric, length),
            None => Ok(()),
        }
    }

    /// Puts the free pieces on the device.
    fn pieces_prepare(&mut self) -> Result<()> {
        let SemiImplicit { held, pieces, free, .. } = &mut self.semi_implicit;
        if free.is_none() {
            let pieces = pieces.get_or_insert_with(|| self.model.connected_pieces());
            *free = Some(FreePieces::new(&self.memory.queue, &PieceBlocks::new(pieces, held))?);
        }
        Ok(())
    }
}

impl<T: CudaReal> SemiImplicitKernels for CudaKernels<T> {
    fn semi_implicit_factorise(&mut self, length: f64, solve: SemiImplicitSolve) -> Result<bool> {
        check_solve(solve)?;
        let is_same = |kept: f64| (kept - length).abs() <= SAME_LENGTH * length;
        if self.semi_implicit.length.is_some_and(is_same) {
            return Ok(false);
        }
        self.fabric_prepare()?;
        let fabric = self.semi_implicit.fabric.take();
        let written = self.constant_write(fabric.as_ref().map(|(fabric, _)| fabric), length);
        self.semi_implicit.fabric = fabric;
        written?;
        let linear = self.linear()?;
        linear.length_set(T::from_f64(length));
        linear.data.has_pairs = 0;
        linear.data.has_contacts = 0;
        self.linear_stage(("semi_implicit_factorise", "semi_implicit_factorise"), &[])?;
        self.preconditioner_build(settings::<T>().preconditioner)?;
        self.semi_implicit.length = Some(length);
        Ok(true)
    }

    fn semi_implicit_solve(&mut self, substep: &Substep) -> Result<()> {
        if !self.has_force || self.semi_implicit.length.is_none() {
            return Ok(());
        }
        let length = T::from_f64(substep.length);
        let name = ("semi_implicit_solve", "semi_implicit_solve");
        let stiffness =
            self.semi_implicit.fabric.as_ref().map_or(0, |(_, buffer)| buffer.address());
        self.linear_stage(name, &[argument(&length), argument(&stiffness)])?;
        self.constant_solve(substep)
    }

    fn torque_correct(&mut self, substep: &Substep) -> Result<()> {
        self.settle()?;
        self.pieces_prepare()?;
        let Some(free) = self.semi_implicit.free.as_ref().filter(|free| free.pieces > 0) else {
            return Ok(());
        };
        let (data, pieces, blocks) = (free.data, free.pieces, free.blocks);
        let launch = |blocks, threads| Launch { blocks, threads, shared: 0, cooperative: false };
        self.stage("torque_correct", |kernels| {
            let module = "torque_correct";
            let arguments = [argument(&data), argument(&substep.length)];
            let name = (module, "torque_correct_sums");
            kernels.linear_start(name, launch(blocks, SUM_THREADS), &arguments)?;
            let name = (module, "torque_correct_turn");
            kernels.start(name, launch(pieces, TURN_THREADS), &[argument(&data)])?;
            let all = Launch::over(kernels.count());
            kernels.linear_start((module, "torque_correct"), all, &[argument(&data)])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dense_inverse_is_refused_by_name() {
        assert_eq!(check_solve(SemiImplicitSolve::Factorisation), Ok(()));
        let Err(error) = check_solve(SemiImplicitSolve::DenseInverse) else {
            panic!("it is not offered");
        };
        assert!(error.to_string().contains("the dense-inverse of the semi-implicit integrator"));
    }

    #[test]
    fn held_particles_that_change_make_the_system_anew() {
        let mut system = SemiImplicit::<f32>::default();
        system.held_set(&[0, 1, 0]);
        system.length = Some(0.01);
        system.held_set(&[0, 1, 0]);
        system.held_write(1, true);
        assert_eq!(system.length, Some(0.01));
        system.held_write(2, true);
        assert_eq!((system.length, system.held[2]), (None, true));
    }
}
