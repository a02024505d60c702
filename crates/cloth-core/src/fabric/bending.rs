//! A triangle of fabric that resists the folds of its three edges (NUMERICS §12).

use super::{
    CurvatureStiffness,
    hinge::{self, Fold},
    vector::{Vector, combination, dot},
};
use crate::Real;

/// For each edge ab, bc, ca of a triangle the places in its patch that [`hinge::fold`] takes: both ends, the triangle's own third
/// corner, the vertex beyond the edge.
pub const FOLD_PLACES: [[usize; 4]; 3] = [[0, 1, 2, 3], [1, 2, 0, 4], [2, 0, 1, 5]];

/// For each edge and place of the patch, which vertex of the fold it is; 4 for none.
const VERTEX_OF_FOLD: [[usize; 6]; 3] =
    [[0, 1, 2, 3, 4, 4], [2, 0, 1, 4, 3, 4], [1, 2, 0, 4, 4, 3]];

/// How a triangle resists folds, in the precision of a solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendingRest<T> {
    /// Folds at rest \[rad\].
    pub angles: [T; 3],
    /// Moments \[N m\] for folds \[rad\].
    pub stiffness: CurvatureStiffness<T>,
    /// Rayleigh damping \[s\].
    pub damping: T,
}

/// The folds of a triangle at one time, and how far they are from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Folds<T> {
    folds: [Fold<T>; 3],
    /// Folds beyond those at rest \[rad\].
    pub differences: [T; 3],
}

/// What a triangle adds to the matrix and the right-hand side of an implicit step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendingTangent<T> {
    folds: [Fold<T>; 3],
    /// (h^2 + h beta) K \[N m s^2\].
    stiffness: CurvatureStiffness<T>,
    /// What it adds to the right-hand side at the six vertices \[N s\].
    pub impulses: [Vector<T>; 6],
}

impl<T: Real> Folds<T> {
    /// The folds of a patch with these vertices \[m\].
    #[inline(always)]
    #[must_use]
    pub fn new(patch: [Vector<T>; 6], rest: &BendingRest<T>) -> Self {
        let folds = FOLD_PLACES.map(|places| hinge::fold(places.map(|place| patch[place])));
        let difference =
            |edge: usize| hinge::difference_of_angles(folds[edge].angle, rest.angles[edge]);
        Self { folds, differences: [difference(0), difference(1), difference(2)] }
    }

    /// Rates of the folds \[rad/s\] for these velocities of the six vertices \[m/s\].
    #[inline(always)]
    #[must_use]
    pub fn rates(&self, velocities: [Vector<T>; 6]) -> [T; 3] {
        let rate = |edge: usize| {
            let [a, b, c, d] = FOLD_PLACES[edge].map(|place| velocities[place]);
            let g = &self.folds[edge].gradient;
            dot(g[0], a) + dot(g[1], b) + dot(g[2], c) + dot(g[3], d)
        };
        [rate(0), rate(1), rate(2)]
    }

    /// Forces of these moments \[N m\] on the six vertices \[N\]: for each minus the sum of moment times gradient over its folds.
    #[inline(always)]
    #[must_use]
    pub fn forces(&self, moments: [T; 3]) -> [Vector<T>; 6] {
        std::array::from_fn(|place| {
            let mut force = [T::ZERO; 3];
            for edge in 0..3 {
                let vertex = VERTEX_OF_FOLD[edge][place];
                if vertex < 4 {
                    let gradient = self.folds[edge].gradient[vertex];
                    force = combination(force, T::ONE, gradient, -moments[edge]);
                }
            }
            force
        })
    }
}

/// Forces on the six vertices of a patch \[N\], dampers included, for their positions \[m\] and velocities \[m/s\].
#[inline(always)]
#[must_use]
pub fn patch_forces<T: Real>(
    patch: [Vector<T>; 6],
    velocities: [Vector<T>; 6],
    rest: &BendingRest<T>,
) -> [Vector<T>; 6] {
    let folds = Folds::new(patch, rest);
    let mut bent = folds.differences;
    if rest.damping > T::ZERO {
        let rates = folds.rates(velocities);
        bent = [0, 1, 2].map(|edge| bent[edge] + rest.damping * rates[edge]);
    }
    folds.forces(rest.stiffness.moments(bent))
}

/// Energy of a patch \[J\].
#[inline(always)]
#[must_use]
pub fn energy<T: Real>(patch: [Vector<T>; 6], rest: &BendingRest<T>) -> T {
    rest.stiffness.energy(Folds::new(patch, rest).differences)
}

impl<T: Real> BendingTangent<T> {
    /// For a substep of `length` \[s\]. `from_start` says that the step starts from the present velocities: then the forces change
    /// along the way, by -h^2 K v.
    #[inline(always)]
    #[must_use]
    pub fn new(
        patch: [Vector<T>; 6],
        velocities: [Vector<T>; 6],
        rest: &BendingRest<T>,
        length: T,
        from_start: bool,
    ) -> Self {
        let folds = Folds::new(patch, rest);
        let rates = folds.rates(velocities);
        let damped = length * rest.damping;
        let along = if from_start { length * length + damped } else { damped };
        let bent = [0, 1, 2].map(|edge| length * folds.differences[edge] + along * rates[edge]);
        let weight = length * length + damped;
        Self {
            folds: folds.folds,
            stiffness: CurvatureStiffness {
                entries: rest.stiffness.entries.map(|entry| weight * entry),
            },
            impulses: folds.forces(rest.stiffness.moments(bent)),
        }
    }

    /// The block of two places of the patch \[kg\], row by row: the sum of K_ef grad_e grad_f^T. All blocks together are symmetric
    /// and positive semi-definite.
    #[inline(always)]
    #[must_use]
    pub fn block(&self, a: usize, b: usize) -> [Vector<T>; 3] {
        let mut moments = [[T::ZERO; 3]; 3];
        for (edge, fold) in self.folds.iter().enumerate() {
            let vertex = VERTEX_OF_FOLD[edge][b];
            if vertex < 4 {
                for (other, moment) in moments.iter_mut().enumerate() {
                    let k = self.stiffness.entry(other, edge);
                    *moment = combination(*moment, T::ONE, fold.gradient[vertex], k);
                }
            }
        }
        let mut block = [[T::ZERO; 3]; 3];
        for (edge, fold) in self.folds.iter().enumerate() {
            let vertex = VERTEX_OF_FOLD[edge][a];
            if vertex < 4 {
                for (row, entry) in block.iter_mut().zip(fold.gradient[vertex]) {
                    *row = combination(*row, T::ONE, moments[edge], entry);
                }
            }
        }
        block
    }
}
