//! The semi-implicit integrator: its constant system is solved by the conjugate gradient method, in the kernels
//! of the implicit one.

use cloth_core::{
    Error, FabricMatrix, LinearMethod, LinearSettings, LinearStart, LinearStop, MatrixForm, Model,
    ModelError, PieceBlocks, Preconditioner, Result, SemiImplicitSolve, stepper::Substep,
};

use super::Stages;
use crate::{
    dispatch::WORKGROUP,
    fault::BACKEND,
    layout::{CALL_REFINE, Call},
};

/// How the system is solved: as far as single precision allows.
pub(super) const LINEAR: LinearSettings = LinearSettings {
    method: LinearMethod::ConjugateGradient,
    preconditioner: Preconditioner::Diagonal,
    matrix: MatrixForm::MatrixFree,
    stop: LinearStop::Residual,
    tolerance: 3e-7,
    iterations_max: 4000,
    warm_start: true,
};

/// Solves of a substep: the second one starts from the residual computed anew, as the one that an iteration
/// carries along drifts away from it by rounding.
pub(super) const PASSES: u32 = 2;

/// Bytes of the sums of a block of particles, and of the rotation of a piece.
const SUMS_SIZE: u64 = 128;
const TURN_SIZE: u64 = 48;

/// What is known of the constant system.
#[derive(Debug, Default)]
pub(super) struct SemiImplicit {
    /// Length of the substeps that the matrix is for \[s\].
    pub(super) length: Option<f64>,
    pieces: Option<Vec<Vec<u32>>>,
    /// What triangles of fabric add.
    fabric: Option<FabricMatrix>,
    /// Free pieces and their blocks, for the particles held at present.
    pub(super) free: Option<[u32; 2]>,
}

impl SemiImplicit {
    /// Other particles are held than before: matrix and free pieces are out of date.
    pub(super) const fn held_changed(&mut self) {
        self.length = None;
        self.free = None;
    }
}

/// # Errors
/// `Unsupported` for the dense inverse.
pub(super) fn solve_check(solve: SemiImplicitSolve) -> Result<()> {
    if solve == SemiImplicitSolve::Factorisation {
        return Ok(());
    }
    let feature = format!("the {solve} of the semi-implicit integrator (it iterates)");
    Err(Error::Unsupported { backend: BACKEND, feature })
}

/// `NonFinite` if the entries of the constant matrix for substeps of `length` \[s\] are beyond single precision, by
/// a bound: the weight of the stiffest spring, for as many springs as the model has, and the largest one of fabric.
fn constant_matrix_check(model: &Model, fabric: Option<&FabricMatrix>, length: f64) -> Result<()> {
    let weight = |stiffness: f64, damping: f64| length * length * stiffness + length * damping;
    let kinds = model.springs().kinds().iter();
    let largest = kinds.map(|kind| weight(kind.stiffness, kind.damping)).fold(0.0, f64::max);
    let of_fabric = fabric.map_or(0.0, |fabric| fabric.weight_max(length));
    let value = largest * model.springs().len() as f64 + of_fabric;
    if (value as f32).is_finite() {
        return Ok(());
    }
    let what = format!("an entry of the constant matrix for a substep of {length} s");
    Err(Error::Invalid(ModelError::NonFinite { what, value }))
}

impl Stages {
    pub(crate) fn semi_implicit_check(&self, solve: SemiImplicitSolve) -> Result<()> {
        solve_check(solve)
    }

    /// Makes sure that the matrix is that of substeps of `length` \[s\].
    pub(super) fn semi_implicit_factorise(&mut self, length: f64) -> Result<()> {
        if self.semi_implicit.length == Some(length) {
            return Ok(());
        }
        let fabric = self.semi_implicit.fabric.take();
        let fabric = match fabric {
            None if self.model.has_fabric() => {
                let fabric = FabricMatrix::constant(&self.model);
                self.fabric_constant_prepare(&fabric)?;
                Some(fabric)
            }
            other => other,
        };
        constant_matrix_check(&self.model, fabric.as_ref(), length)?;
        if let Some(fabric) = &fabric {
            self.fabric_constant_write(fabric, length)?;
        }
        self.semi_implicit.fabric = fabric;
        let call = Call { amount: length as f32, ..Call::default() };
        self.linear_kernel("semi_implicit_factorise", 0, call)?;
        self.preconditioner_build(LINEAR.preconditioner)?;
        self.semi_implicit.length = Some(length);
        Ok(())
    }

    pub(super) fn semi_implicit_solve(&mut self, substep: &Substep) -> Result<()> {
        if !self.has_force || self.semi_implicit.length.is_none() {
            return Ok(());
        }
        let slot = self.slot(substep)?;
        self.linear_kernel("semi_implicit_solve", slot, Call::default())?;
        if self.defers() {
            let start =
                if substep.index > 0 { LinearStart::Solution } else { LinearStart::Constraints };
            for (pass, start) in [(0, start), (1, LinearStart::Solution)] {
                let call = Call {
                    pass_number: pass,
                    pass_count: PASSES,
                    flags: if pass > 0 { CALL_REFINE } else { 0 },
                    ..Call::default()
                };
                self.pass_record(&LINEAR, start, slot, call)?;
            }
            return Ok(());
        }
        self.solve_now(&LINEAR, LinearStart::Constraints)?;
        self.solve_now(&LINEAR, LinearStart::Solution)?;
        Ok(())
    }

    pub(super) fn torque_correct(&mut self, substep: &Substep) -> Result<()> {
        let [pieces, blocks] = self.pieces_prepare()?;
        if pieces == 0 {
            return Ok(());
        }
        let slot = self.slot(substep)?;
        let (stage, present) = ("torque_correct", self.present);
        self.dispatch(stage, "torque_correct_sums", (blocks, 1), present, (slot, 0))?;
        self.dispatch(stage, "torque_correct_turn", (pieces, 1), present, (slot, 0))?;
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch(stage, "torque_correct", items, present, (slot, 0))
    }

    /// Numbers of free pieces and of their blocks, whose tables are then on the device.
    fn pieces_prepare(&mut self) -> Result<[u32; 2]> {
        if let Some(free) = self.semi_implicit.free {
            return Ok(free);
        }
        let pieces = self.semi_implicit.pieces.get_or_insert_with(|| self.model.connected_pieces());
        let tables = PieceBlocks::new(pieces, &self.held);
        let free = [tables.rows.len(), tables.blocks.len()].map(|count| count as u32);
        for (name, contents) in [
            ("piece_rows", bytemuck::cast_slice(&tables.rows)),
            ("piece_blocks", bytemuck::cast_slice(&tables.blocks)),
            ("piece_particles", bytemuck::cast_slice(&tables.particles)),
            ("piece_of", bytemuck::cast_slice(&tables.piece_of)),
        ] {
            let contents: &[u8] = contents;
            self.buffers.create(&self.context, name, contents.len() as u64, Some(contents))?;
        }
        let [turns, sums] = [u64::from(free[0]) * TURN_SIZE, u64::from(free[1]) * SUMS_SIZE];
        self.buffers.create(&self.context, "piece_turns", turns, None)?;
        self.buffers.create(&self.context, "piece_partials", sums, None)?;
        self.bind_groups.clear();
        self.semi_implicit.free = Some(free);
        Ok(free)
    }
}
