//! How pieces come to rest.
//!
//! The matrix A = M + h^2 K and the right-hand side h f of an implicit step from rest (NUMERICS §5) are those of Newton's method for
//! f = 0 with a mass that keeps it near: as h grows it becomes Newton's method. K leaves out what would make it indefinite, so that
//! every step goes downhill, and has folds on their own for bending, so that it takes more of them. Steps are shortened where they would turn edges far: a cloth that hardly stretches follows circles, and
//! a straight step stretches it by half of the square of the angle, which the next one takes back.

mod factorisation;

use std::sync::Arc;

use cloth_core::{
    Kernels, LinearVector, MatrixBlock, Model, NewtonStart, Result, State,
    stepper::{FramePlan, Substep, implicit},
};

use crate::Laboratory;
use factorisation::Factorisation;

/// How a piece is brought to rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settling {
    /// Steps at most.
    pub(crate) steps_max: u32,
    /// The largest motion in a step, relative to the size of the piece, at which it counts as at rest.
    pub(crate) motion: f64,
}

/// h at first and at last \[s\]. With the last one the mass holds a cloth back by some 10^-4 of what gravity does.
const LENGTHS: [f64; 2] = [0.02, 10.0];

/// By how much h grows after a step.
const GROWTH: f64 = 1.8;

/// Shares by which the diagonal is made larger, one after the other, where rounding of a backend in single precision has left a matrix that is not
/// positive definite: no more than the last one, with which soft modes hardly move.
const SHIFTS: [f64; 3] = [0.0, 1e-7, 1e-6];

/// Steps below this share of the size of a piece are those of a method that converges.
const FINE: f64 = 1e-3;

/// The angle by which an edge may turn in a step \[rad\], about.
const TURN: f64 = 0.35;

impl Settling {
    /// As close as the precision of a laboratory allows.
    pub(crate) fn of(laboratory: &Laboratory<'_>) -> Self {
        Self { steps_max: 2000, motion: if laboratory.is_double() { 1e-7 } else { 2e-5 } }
    }
}

/// A piece that is brought to rest.
pub(crate) struct Statics {
    kernels: Box<dyn Kernels>,
    model: Arc<Model>,
    factorisation: Factorisation,
    edges: Vec<([usize; 2], f64)>,
    state: State,
    blocks: Vec<MatrixBlock>,
    right_side: Vec<[f64; 3]>,
}

impl Statics {
    /// A piece at its start.
    ///
    /// # Errors
    /// What the backend reports.
    pub(crate) fn new(laboratory: &Laboratory<'_>, model: &Arc<Model>) -> Result<Self> {
        let state = model.initial_state();
        let edges = model.elements().edges().iter().map(|edge| {
            let [a, b] = edge.map(|particle| particle as usize);
            ([a, b], length(difference(state.positions[a], state.positions[b])))
        });
        Ok(Self {
            kernels: laboratory.kernels(model)?,
            factorisation: Factorisation::new(&state.held),
            edges: edges.collect(),
            model: Arc::clone(model),
            state,
            blocks: Vec::new(),
            right_side: Vec::new(),
        })
    }

    /// Where all particles are \[m\].
    pub(crate) fn positions(&self) -> &[[f64; 3]] {
        &self.state.positions
    }

    /// Moves particles; those that are held stay where they are put.
    pub(crate) fn place(&mut self, place: impl Fn(usize, [f64; 3]) -> [f64; 3]) {
        for (particle, position) in self.state.positions.iter_mut().enumerate() {
            *position = place(particle, *position);
        }
    }

    /// The step of an implicit integrator of length h \[s\] from rest \[m\]. `None` if the matrix is not positive definite.
    pub(crate) fn step(&mut self, h: f64) -> Result<Option<Vec<[f64; 3]>>> {
        let substep = Substep {
            index: 0,
            step: 1,
            time: 0.0,
            length: h,
            wind_velocity: [0.0; 3],
            anchor_offset: [0.0; 3],
        };
        let plan = FramePlan { substeps: vec![substep], ..FramePlan::default() };
        self.kernels.state_write(&self.state)?;
        self.kernels.frame_begin(&plan)?;
        self.kernels.state_keep()?;
        implicit::system(&mut *self.kernels, &substep, NewtonStart::StepStart)?;
        self.kernels.matrix_read(&mut self.blocks)?;
        self.kernels.vector_read(LinearVector::RightSide, &mut self.right_side)?;
        let mut solve = |shift| self.factorisation.solve(&self.blocks, &self.right_side, shift);
        let change = SHIFTS.into_iter().find_map(&mut solve);
        Ok(change.map(|change| change.iter().map(|y| y.map(|y| h * y)).collect()))
    }

    /// Brings the piece to rest; whether it came to rest.
    ///
    /// # Errors
    /// What the backend reports.
    pub(crate) fn settle(&mut self, settling: &Settling) -> Result<bool> {
        let size = self.size();
        let mut h = LENGTHS[0];
        let mut turn_max = TURN;
        let mut before: Vec<[f64; 3]> = Vec::new();
        for _ in 0..settling.steps_max {
            let Some(step) = self.step(h)? else {
                if h < LENGTHS[0] {
                    return Ok(false);
                }
                h *= 0.25;
                continue;
            };
            let longest = step.iter().map(|&d| length(d)).fold(0.0, f64::max);
            if !longest.is_finite() {
                return Ok(false);
            }
            // Steps to and fro go too far, unless they are small.
            let along: f64 = before.iter().zip(&step).map(|(&a, &b)| dot(a, b)).sum();
            let square = |field: &[[f64; 3]]| field.iter().map(|&d| dot(d, d)).sum::<f64>();
            let is_back =
                longest > FINE * size && along < -0.3 * (square(&before) * square(&step)).sqrt();
            turn_max =
                if is_back { (0.5 * turn_max).max(1e-3) } else { (1.2 * turn_max).min(TURN) };
            let scale = (turn_max / self.turn(&step)).min(1.0);
            self.place(|particle, x| sum(x, step[particle], scale));
            if longest <= settling.motion * size && h >= LENGTHS[1] {
                return Ok(true);
            }
            h = if is_back { (0.5 * h).max(LENGTHS[0]) } else { (GROWTH * h).min(LENGTHS[1]) };
            before = step;
        }
        Ok(false)
    }

    /// The largest angle by which an edge turns, about \[rad\].
    fn turn(&self, step: &[[f64; 3]]) -> f64 {
        let turn =
            |&([a, b], rest): &([usize; 2], f64)| length(difference(step[a], step[b])) / rest;
        self.edges.iter().map(turn).fold(1e-30, f64::max)
    }

    /// The length of the diagonal of the box around the piece at its start \[m\].
    fn size(&self) -> f64 {
        let extent = |k: usize| {
            let all = || self.model.positions().iter().map(|x| x[k]);
            all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min)
        };
        length([extent(0), extent(1), extent(2)])
    }
}

impl Laboratory<'_> {
    /// The positions \[m\] at which a model comes to rest from its start; no numbers if it does not.
    ///
    /// # Errors
    /// What the backend reports.
    pub(crate) fn rest(&self, model: &Arc<Model>) -> Result<Vec<[f64; 3]>> {
        let mut statics = Statics::new(self, model)?;
        let settled = statics.settle(&Settling::of(self))?;
        Ok(if settled {
            statics.state.positions
        } else {
            vec![[f64::NAN; 3]; model.particle_count()]
        })
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    sum(a, b, -1.0)
}

fn sum(a: [f64; 3], b: [f64; 3], scale: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + scale * b[k])
}
