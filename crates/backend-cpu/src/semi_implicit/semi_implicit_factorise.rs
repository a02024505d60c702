//! NUMERICS §6, `semi_implicit_factorise`: the constant matrix and its factorisations.

use cloth_core::{
    Divergence, DivergenceCause, DivergenceOrigin, Error, FabricMatrix, Model, Real, Result,
    SemiImplicitSolve,
};

use super::{
    constant_matrix,
    dense_inverse::{self, DenseInverse},
};
use crate::{
    memory::{Masses, VectorField},
    sparse_cholesky::{
        LowerPattern, Neighbourhood, Panels, SparseCholesky, SupernodalSolver, nested_dissection,
    },
};

/// Factorisations that are kept: one for the length of substeps, one for the shorter last substep
/// of a frame.
const KEPT: usize = 2;

/// Lengths that differ by less than this share of them differ by rounding: that of the last substep
/// of a frame is what is left of it.
const SAME_LENGTH: f64 = 1e-9;

/// The constant matrix, factorised for the last few lengths of substeps.
pub(crate) struct SemiImplicit<T> {
    factorisation: SparseCholesky,
    solver: SupernodalSolver<T>,
    matrix: Vec<f64>,
    held: Vec<bool>,
    /// The factorisations, the one used last first.
    kept: Vec<Kept<T>>,
    /// What triangles of fabric add, and its stiffness with the sign that springs have \[N/m\].
    fabric: Option<FabricMatrix>,
    stiffness: Vec<T>,
    pub(super) right_side: VectorField<T>,
}

/// What is kept of a factorisation.
struct Kept<T> {
    length: f64,
    form: Form<T>,
}

enum Form<T> {
    Factorisation(Panels<T>),
    DenseInverse(DenseInverse<T>),
}

impl<T> Form<T> {
    fn is(&self, solve: SemiImplicitSolve) -> bool {
        match self {
            Self::Factorisation(_) => solve == SemiImplicitSolve::Factorisation,
            Self::DenseInverse(_) => solve == SemiImplicitSolve::DenseInverse,
        }
    }
}

impl<T: Real> SemiImplicit<T> {
    /// Analyses the matrix of a model.
    ///
    /// # Errors
    /// `OutOfMemory`, or `LimitExceeded` for a model too large to be indexed.
    pub(crate) fn new(model: &Model, margin: usize) -> Result<Self> {
        let count = model.particle_count();
        let mut pairs = Vec::new();
        model.interactions().in_matrix().for_each_pair(|a, b| pairs.push([a, b]));
        let neighbourhood = Neighbourhood::new(count, &pairs);
        let pieces = neighbourhood.pieces();
        let order = nested_dissection(model.positions(), &neighbourhood, &pieces);
        let order: Vec<usize> = order.into_iter().map(|particle| particle as usize).collect();
        let pattern = LowerPattern::of_particles(&neighbourhood);
        let fabric = model.has_fabric().then(|| FabricMatrix::constant(model));
        let factorisation = SparseCholesky::new(pattern, Some(&order))?;
        Ok(Self {
            solver: SupernodalSolver::new(&factorisation)?,
            factorisation,
            matrix: Vec::new(),
            held: Vec::new(),
            kept: Vec::new(),
            stiffness: match &fabric {
                Some(fabric) => {
                    fabric.entries().iter().map(|e| T::from_f64(-e.stiffness)).collect()
                }
                None => Vec::new(),
            },
            fabric,
            right_side: VectorField::new(count, margin),
        })
    }

    /// Number of particles.
    pub(super) fn len(&self) -> usize {
        self.factorisation.pattern().len()
    }

    /// The triangles around a particle in the right-hand side: its neighbours, and the stiffness to each.
    pub(super) fn fabric_row(&self, particle: usize) -> (&[u32], &[T]) {
        match &self.fabric {
            Some(fabric) => {
                (fabric.neighbours().row(particle), &self.stiffness[fabric.row(particle)])
            }
            None => (&[], &[]),
        }
    }

    /// Takes note of the particles held at present.
    pub(crate) fn held_update(&mut self, masses: &Masses<T>) {
        let count = self.factorisation.pattern().len();
        let is_same = self.held.len() == count
            && self.held.iter().enumerate().all(|(i, &held)| held == masses.is_held(i));
        if !is_same {
            self.kept.clear();
            self.held.clear();
            self.held.extend((0..count).map(|particle| masses.is_held(particle)));
        }
    }

    /// Makes sure that the factorisation for substeps of `length` \[s\] is the first one; returns
    /// whether it had to be made.
    ///
    /// # Errors
    /// `LimitExceeded` for a dense inverse of too many particles; `Invalid` if the numbers of the
    /// matrix overflow, `Diverged` if it cannot be factorised all the same.
    pub(crate) fn factorise(
        &mut self,
        model: &Model,
        length: f64,
        solve: SemiImplicitSolve,
    ) -> Result<bool> {
        let is_wanted = |kept: &Kept<T>| {
            (kept.length - length).abs() <= SAME_LENGTH * length && kept.form.is(solve)
        };
        if let Some(place) = self.kept.iter().position(is_wanted) {
            self.kept[..=place].rotate_right(1);
            return Ok(false);
        }
        // Out of the list first, so that a failure leaves no factorisation under a wrong name.
        let oldest = if self.kept.len() == KEPT { self.kept.pop() } else { None };
        let oldest = oldest.map(|kept| kept.form).filter(|form| form.is(solve));
        let form = match solve {
            SemiImplicitSolve::Factorisation => {
                self.factorise_sparse(model, length)?;
                let mut panels = match oldest {
                    Some(Form::Factorisation(panels)) => panels,
                    _ => Panels::default(),
                };
                self.solver.fill(&mut panels, &self.matrix, &self.factorisation);
                Form::Factorisation(panels)
            }
            SemiImplicitSolve::DenseInverse => {
                dense_inverse::check_size(self.held.len())?;
                self.factorise_sparse(model, length)?;
                let mut inverse = match oldest {
                    Some(Form::DenseInverse(inverse)) => inverse,
                    _ => DenseInverse::default(),
                };
                inverse.fill(&mut self.factorisation);
                Form::DenseInverse(inverse)
            }
            _ => {
                let feature = format!("the solve {solve:?} of the semi-implicit integrator");
                return Err(Error::Unsupported { backend: "cpu", feature });
            }
        };
        self.kept.insert(0, Kept { length, form });
        Ok(true)
    }

    fn factorise_sparse(&mut self, model: &Model, length: f64) -> Result<()> {
        let Self { factorisation, matrix, held, fabric, .. } = self;
        let fabric = fabric.as_ref();
        constant_matrix::fill(model, fabric, factorisation.pattern(), held, length, matrix)?;
        if factorisation.factorise(matrix).is_ok() {
            return Ok(());
        }
        // Never seen, as the matrix exceeds one without negative eigenvalues by more than rounding.
        Err(Error::Diverged(Divergence {
            step: 0,
            time: 0.0,
            particle: 0,
            cause: DivergenceCause::LinearSolver,
            time_step: length,
            // A limit of the explicit scheme says nothing here.
            stable_time_step: None,
            origin: DivergenceOrigin::Unknown,
        }))
    }

    /// Solves W y = b, b the right-hand side, with the first factorisation.
    pub(crate) fn solve(&mut self, solution: &mut VectorField<T>, arch: pulp::Arch) {
        match self.kept.first().map(|kept| &kept.form) {
            Some(Form::Factorisation(panels)) => {
                self.solver.solve(panels, &self.right_side, solution, arch);
            }
            Some(Form::DenseInverse(inverse)) => inverse.solve(&self.right_side, solution, arch),
            None => {}
        }
    }
}
