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

/// What a triangle adds to the matrix and the right-hand side of an implicit step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendingTangent<T> {
    /// Derivatives of the three curvatures by the vertices \[1/m^2\].
    gradients: [[Vector<T>; PATCH]; 3],
    /// (h^2 + h beta) A D times these.
    moments: [[Vector<T>; PATCH]; 3],
    /// What it adds to the right-hand side at the vertices \[N s\].
    pub impulses: [Vector<T>; PATCH],
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

    /// The sum of the derivatives of the folds by the vertices \[1/m\], each times its share.
    #[inline(always)]
    fn gradients(&self, shares: &[T; FOLDS]) -> [Vector<T>; PATCH] {
        self.forces(shares.map(|share| -share))
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

/// Forces on the vertices of a patch \[N\], dampers included, for their positions \[m\] and velocities \[m/s\].
#[inline(always)]
#[must_use]
pub fn patch_forces<T: Real>(
    patch: [Vector<T>; PATCH],
    velocities: [Vector<T>; PATCH],
    rest: &BendingRest<T>,
) -> [Vector<T>; PATCH] {
    let folds = Folds::new(patch, rest);
    let mut bent = folds.differences;
    if rest.damping > T::ZERO {
        let rates = folds.rates(velocities);
        bent = std::array::from_fn(|edge| bent[edge] + rest.damping * rates[edge]);
    }
    folds.forces(rest.stiffness.moments(bent))
}

/// Energy of a patch \[J\].
#[inline(always)]
#[must_use]
pub fn energy<T: Real>(patch: [Vector<T>; PATCH], rest: &BendingRest<T>) -> T {
    rest.stiffness.energy(Folds::new(patch, rest).differences)
}

impl<T: Real> BendingTangent<T> {
    /// For a substep of `length` \[s\]. `from_start` says that the step starts from the present velocities: then the forces change
    /// along the way, by -h^2 K v.
    #[inline(always)]
    #[must_use]
    pub fn new(
        patch: [Vector<T>; PATCH],
        velocities: [Vector<T>; PATCH],
        rest: &BendingRest<T>,
        length: T,
        from_start: bool,
    ) -> Self {
        let folds = Folds::new(patch, rest);
        let rates = folds.rates(velocities);
        let damped = length * rest.damping;
        let along = if from_start { length * length + damped } else { damped };
        let bent: [T; FOLDS] =
            std::array::from_fn(|edge| length * folds.differences[edge] + along * rates[edge]);
        let weight = length * length + damped;
        let gradients = rest.stiffness.map.map(|row| folds.gradients(&row));
        let [d11, d22, d12, d66] = rest.stiffness.plate.map(|entry| weight * entry);
        let [a, b, c] = &gradients;
        let zero = [T::ZERO; 3];
        let moments = [
            std::array::from_fn(|k| combination(a[k], d11, b[k], d12)),
            std::array::from_fn(|k| combination(a[k], d12, b[k], d22)),
            std::array::from_fn(|k| combination(zero, T::ONE, c[k], d66)),
        ];
        let impulses = folds.forces(rest.stiffness.moments(bent));
        Self { gradients, moments, impulses }
    }

    /// The block of two places of the patch \[kg\], row by row: the sum over the curvatures of gradient times moment. All blocks together are
    /// symmetric and positive semi-definite.
    #[inline(always)]
    #[must_use]
    pub fn block(&self, a: usize, b: usize) -> [Vector<T>; 3] {
        let mut block = [[T::ZERO; 3]; 3];
        for (gradient, moment) in self.gradients.iter().zip(&self.moments) {
            for (row, entry) in block.iter_mut().zip(gradient[a]) {
                *row = combination(*row, T::ONE, moment[b], entry);
            }
        }
        block
    }
}
