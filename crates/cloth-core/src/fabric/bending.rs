//! A triangle of fabric that resists curvature, as the folds around it tell it (NUMERICS §12).

use super::{
    CurvatureStiffness,
    curvature::FOLDS,
    hinge::{self, Fold},
    vector::{Vector, combination, dot},
};
use crate::Real;

/// Vertices of the patch of a triangle: its corners, those beyond its edges, and for each of these triangles the two beyond its other edges.
pub const PATCH: usize = 12;

/// For each fold of a patch the places that [`hinge::fold`] takes: both ends of the edge, the third corner of the triangle, the vertex beyond. The edges ab, bc,
/// ca of the triangle come first; then, for each of them, those of the triangle beyond it, from its start to the apex and from there to its end.
pub const FOLD_PLACES: [[usize; 4]; FOLDS] = [
    [0, 1, 2, 3],
    [1, 2, 0, 4],
    [2, 0, 1, 5],
    [0, 3, 1, 6],
    [3, 1, 0, 7],
    [1, 4, 2, 8],
    [4, 2, 1, 9],
    [2, 5, 0, 10],
    [5, 0, 2, 11],
];

/// For each fold and place of the patch, which vertex of the fold it is; 4 for none.
const VERTEX_OF_FOLD: [[usize; PATCH]; FOLDS] = {
    let mut table = [[4; PATCH]; FOLDS];
    let mut fold = 0;
    while fold < FOLDS {
        let mut vertex = 0;
        while vertex < 4 {
            table[fold][FOLD_PLACES[fold][vertex]] = vertex;
            vertex += 1;
        }
        fold += 1;
    }
    table
};

/// How a triangle resists folds, in the precision of a solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendingRest<T> {
    /// Folds at rest \[rad\].
    pub angles: [T; FOLDS],
    /// Moments \[N m\] for folds \[rad\].
    pub stiffness: CurvatureStiffness<T>,
    /// Rayleigh damping \[s\].
    pub damping: T,
}

/// The folds of a triangle at one time, and how far they are from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Folds<T> {
    folds: [Fold<T>; FOLDS],
    /// Folds beyond those at rest \[rad\].
    pub differences: [T; FOLDS],
}

impl<T: Real> Folds<T> {
    /// The folds of a patch with these vertices \[m\].
    #[inline(always)]
    #[must_use]
    pub fn new(patch: [Vector<T>; PATCH], rest: &BendingRest<T>) -> Self {
        let folds = FOLD_PLACES.map(|places| hinge::fold(places.map(|place| patch[place])));
        let difference =
            |edge: usize| hinge::difference_of_angles(folds[edge].angle, rest.angles[edge]);
        Self { differences: std::array::from_fn(difference), folds }
    }

    /// Rates of the folds \[rad/s\] for these velocities of the vertices \[m/s\].
    #[inline(always)]
    #[must_use]
    pub fn rates(&self, velocities: [Vector<T>; PATCH]) -> [T; FOLDS] {
        let rate = |edge: usize| {
            let [a, b, c, d] = FOLD_PLACES[edge].map(|place| velocities[place]);
            let g = &self.folds[edge].gradient;
            dot(g[0], a) + dot(g[1], b) + dot(g[2], c) + dot(g[3], d)
        };
        std::array::from_fn(rate)
    }

    /// Forces of these moments \[N m\] on the vertices \[N\]: for each minus the sum of moment times gradient over its folds.
    #[inline(always)]
    #[must_use]
    pub fn forces(&self, moments: [T; FOLDS]) -> [Vector<T>; PATCH] {
        std::array::from_fn(|place| {
            let mut force = [T::ZERO; 3];
            for edge in 0..FOLDS {
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

/// Energy of a patch \[J\].
#[inline(always)]
#[must_use]
pub fn energy<T: Real>(patch: [Vector<T>; PATCH], rest: &BendingRest<T>) -> T {
    rest.stiffness.energy(Folds::new(patch, rest).differences)
}
