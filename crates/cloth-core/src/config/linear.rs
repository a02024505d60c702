//! Settings of the solvers of linear systems.

use crate::{
    LinearOutcome, Model, ModelError,
    error::{in_range, positive},
};

use super::names::names;

/// How the linear system of an implicit step is solved (NUMERICS §5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSettings {
    /// The method.
    pub method: LinearMethod,
    /// Preconditioner of the conjugate gradient method.
    pub preconditioner: Preconditioner,
    /// How the matrix is multiplied with a vector.
    pub matrix: MatrixForm,
    /// What an iteration measures to know when to stop.
    pub stop: LinearStop,
    /// What `stop` measures, relative to the start, at which an iteration stops; 0 runs to the cap.
    pub tolerance: f64,
    /// Cap on iterations. A solve that reaches it stands as it is, and the report says so.
    pub iterations_max: u32,
    /// Whether an iteration starts from the answer of the substep before, within a frame. Off, it
    /// starts from no change of velocity.
    pub warm_start: bool,
}

/// A method for linear systems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum LinearMethod {
    /// Modified preconditioned conjugate gradient (Ascher and Boxerman 2003).
    #[default]
    ConjugateGradient,
    /// Damped block Jacobi.
    Jacobi,
    /// Sparse Cholesky factorisation in double precision: exact, for small models.
    Direct,
}

/// A preconditioner of the conjugate gradient method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Preconditioner {
    /// The diagonal of the matrix.
    Diagonal,
    /// Its 3 x 3 diagonal blocks.
    #[default]
    Block,
    /// Incomplete Cholesky factorisation without fill, in blocks of 3 x 3, of the matrix less
    /// what couples its parts of fixed size.
    IncompleteCholesky,
    /// `Block`, and what rigid motions of groups of 32 particles do to the system, by one V-cycle over groups of groups: iterations that hardly grow
    /// with the number of particles.
    Schwarz,
    /// `Schwarz` where it was measured to win on the backend, else `Block`.
    Auto,
}

/// What [`Preconditioner::Auto`] stands for in the solves of a frame: `Block`, until `Schwarz` is shown to be faster. How many iterations `Block` takes
/// follows from stiffness, step and the shapes of triangles more than from the number of particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AutoPreconditioner {
    /// `Block`, and after so many iterations of a solve `Schwarz` goes on.
    Block(u32),
    /// `Schwarz`.
    Schwarz,
}

impl AutoPreconditioner {
    /// What a frame begins with: so many iterations `Block` may take before the other one is tried.
    const FIRST: Self = Self::Block(150);

    /// How many times as long an iteration of `Schwarz` takes as one of `Block` on two threads.
    const COST: f64 = 2.0;

    /// What to take once `Block` was stopped with a relative residual `left`, and `Schwarz` has gone on from there: `Schwarz`, if all of the solve would
    /// take it less time than `Block` twice as many iterations as it has had, as far as it got in each iteration. Else `Block` may take four times as many
    /// before the other one is tried again.
    ///
    /// How far `Block` got says little: what lasts long in it comes last, and it is likely to need as many again.
    #[must_use]
    pub fn after(self, left: f64, rest: &LinearOutcome) -> Self {
        let Self::Block(trial) = self else { return self };
        let each = (left / rest.residual).ln() / f64::from(rest.iterations);
        let all = -rest.residual.ln() / each;
        if each > 0.0 && Self::COST * all < 2.0 * f64::from(trial) {
            Self::Schwarz
        } else {
            Self::Block(trial.saturating_mul(4))
        }
    }

    /// What a preconditioner is by this, which matters to [`Preconditioner::Auto`] alone.
    #[must_use]
    pub const fn resolve(self, preconditioner: Preconditioner) -> Preconditioner {
        match (preconditioner, self) {
            (Preconditioner::Auto, Self::Block(_)) => Preconditioner::Block,
            (Preconditioner::Auto, Self::Schwarz) => Preconditioner::Schwarz,
            (given, _) => given,
        }
    }
}

impl Default for AutoPreconditioner {
    fn default() -> Self {
        Self::FIRST
    }
}

/// When an iteration is good enough.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum LinearStop {
    /// By the residual |b - A y| / |b|.
    #[default]
    Residual,
    /// By the error in the norm of the energy, sqrt(e A e), relative to that of the start, which conjugate gradients estimate
    /// as they run (Hestenes and Stiefel 1952; Strakoš and Tichý 2002).
    Energy,
}

impl Preconditioner {
    /// Particles of a piece of fabric from which on `Auto` may stand for `Schwarz`. It is the same on all backends that have both, so that they have the
    /// same bits: on the CPU smaller pieces would gain a little, on CUDA those of ten thousand gain as little.
    pub const SCHWARZ_MIN: usize = 4_000;

    /// What is left of `Auto` in a model before anything is solved: `Auto`, which each frame decides, where a piece of fabric has
    /// `schwarz_min` particles or more, and else `Block`. `schwarz_min` is [`Self::SCHWARZ_MIN`] on backends where `Schwarz` may win (INTEGRATORS.md has the
    /// measurements). The others stand for themselves.
    #[must_use]
    pub fn resolved(self, model: &Model, schwarz_min: Option<usize>) -> Self {
        let may_win = |least| {
            model.has_fabric() && model.particle_count() >= least && model.largest_piece() >= least
        };
        match self {
            Self::Auto if schwarz_min.is_some_and(may_win) => Self::Auto,
            Self::Auto => Self::Block,
            given => given,
        }
    }

    /// What a frame begins with.
    #[must_use]
    pub const fn at_first(self) -> Self {
        AutoPreconditioner::FIRST.resolve(self)
    }

    /// Why `Auto` stands for this one in a model.
    #[must_use]
    pub fn auto_reason(self, model: &Model) -> &'static str {
        match self {
            Self::Schwarz => "block takes hundreds of iterations in so large a piece of fabric",
            _ if model.has_fabric() && model.largest_piece() < Self::SCHWARZ_MIN => {
                "schwarz does not pay for pieces of fewer than 4,000 particles"
            }
            _ if model.has_fabric() => {
                "it is done before schwarz would pay (which wgpu takes only if told to)"
            }
            _ => "iterations of others are too dear for springs",
        }
    }
}

/// How the matrix is multiplied with a vector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum MatrixForm {
    /// Spring by spring, from the two factors and the direction that a step fixes.
    #[default]
    MatrixFree,
    /// From 3 x 3 blocks in symmetric sparse rows.
    Assembled,
}

impl Default for LinearSettings {
    fn default() -> Self {
        Self {
            method: LinearMethod::default(),
            preconditioner: Preconditioner::default(),
            matrix: MatrixForm::default(),
            stop: LinearStop::default(),
            tolerance: 1e-3,
            iterations_max: 1000,
            warm_start: false,
        }
    }
}

impl LinearSettings {
    pub(super) fn validate(&self) -> Result<(), ModelError> {
        in_range(|| "tolerance of the linear solver".into(), self.tolerance, [0.0, 1.0])?;
        positive(|| "iterations of the linear solver".into(), f64::from(self.iterations_max))?;
        if self.stop == LinearStop::Energy && self.method != LinearMethod::ConjugateGradient {
            return Err(ModelError::StopWithoutEstimate { method: self.method });
        }
        Ok(())
    }
}

names!(LinearMethod, "linear solver",
    LinearMethod::ConjugateGradient => "cg",
    LinearMethod::Jacobi => "jacobi",
    LinearMethod::Direct => "direct");
names!(Preconditioner, "preconditioner",
    Preconditioner::Diagonal => "diagonal",
    Preconditioner::Block => "block",
    Preconditioner::IncompleteCholesky => "incomplete-cholesky",
    Preconditioner::Schwarz => "schwarz",
    Preconditioner::Auto => "auto");
names!(LinearStop, "measure of the linear solver",
    LinearStop::Residual => "residual",
    LinearStop::Energy => "energy");
names!(MatrixForm, "matrix form",
    MatrixForm::MatrixFree => "matrix-free",
    MatrixForm::Assembled => "assembled");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cloth, GridPatch, MaterialPreset, ModelBuilder, example::sheet};

    #[test]
    fn auto_asks_how_many_iterations_block_takes_where_a_piece_is_large() {
        use Preconditioner::{Auto, Block, Schwarz};
        let fabric = sheet(6, 1.1);
        let count = fabric.particle_count();
        assert_eq!(fabric.largest_piece(), count);
        assert_eq!(Auto.resolved(&fabric, None), Block);
        assert_eq!(Auto.resolved(&fabric, Some(count + 1)), Block);
        assert_eq!(Auto.resolved(&fabric, Some(count)), Auto);
        assert_eq!(Schwarz.resolved(&fabric, None), Schwarz);
        let cloth = Cloth::grid("springs", GridPatch::new([9, 9], 0.02), &MaterialPreset::DENIM);
        let springs = ModelBuilder::new().cloth(cloth).build().unwrap();
        assert_eq!(Auto.resolved(&springs, Some(1)), Block);
    }

    #[test]
    fn schwarz_is_taken_where_it_is_faster() {
        use AutoPreconditioner::Schwarz;
        use Preconditioner::{Auto, Block};
        let first = AutoPreconditioner::default();
        let AutoPreconditioner::Block(trial) = first else { panic!("begins with {first:?}") };
        let rest =
            |iterations, residual| LinearOutcome { iterations, residual, ..Default::default() };
        // As in a sheet, of which `Block` has done what goes fast.
        assert_eq!(first.after(0.1, &rest(trial / 5, 1e-3)), Schwarz);
        assert_eq!(first.after(3.0, &rest(trial / 3, 1e-3)), Schwarz);
        // Where all of it would take longer than `Block` twice what it has had.
        let longer = first.after(0.02, &rest(trial / 5, 0.01));
        assert_eq!(longer, AutoPreconditioner::Block(4 * trial));
        assert_eq!(first.after(0.8, &rest(2 * trial, 1e-3)), longer);
        assert_eq!(longer.after(0.8, &rest(2 * trial, 1e-3)), Schwarz);
        // What has done nothing, or made it worse, is no faster.
        for none in [rest(0, 0.8), rest(trial, 0.9), rest(trial, f64::NAN)] {
            assert_eq!(first.after(0.8, &none), longer);
        }
        assert_eq!(Schwarz.after(0.02, &rest(trial, 0.01)), Schwarz);
        assert_eq!(
            [longer, Schwarz].map(|auto| auto.resolve(Auto)),
            [Block, Preconditioner::Schwarz]
        );
        assert_eq!(Schwarz.resolve(Block), Block);
    }
}
