//! Springs that buckle (NUMERICS §2).

use crate::Real;

/// The coefficients c of g(u) = c0 + c1 u + ... + c5 u^5, the dimensionless force of a buckled strut
/// over its compression u = 1 - l/L (NUMERICS §2).
///
/// The polynomial whose largest relative error on \[0, 1\] is smallest, 0.35 %, of the force of Choi
/// and Ko (2002): 4 y^2 / (cos y - sin y / y), where sin y / y = 1 - u and 0 <= y <= pi.
pub const BUCKLING_COEFFICIENTS: [f64; 6] = [
    -11.958_633_060_6,
    -10.018_350_227_3,
    24.969_918_105_0,
    -113.252_152_232,
    161.887_831_573,
    -90.970_939_987_1,
];

/// What the rigidity of a spring adds to its stiffness, in the precision of a solver; [`SpringKind::buckling`](crate::SpringKind::buckling) makes it.
///
/// All methods take the stiffness k \[N/m\] of the spring and its stretch l - L \[m\], and do the
/// operations of NUMERICS §2 in their order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Buckling<T> {
    /// B / L^2 \[N\]; infinite for a spring that never buckles.
    pub force_scale: T,
    /// 1 / L \[1/m\].
    pub inverse_rest_length: T,
    /// What the energy has more on the buckled branch than the work of its force from u = 0 \[J\],
    /// so that it is continuous.
    pub energy_offset: T,
    /// Compression beyond which a spring that does not follow the buckled branch has left it again,
    /// dimensionless; 2, which no spring reaches, if there is no such compression.
    pub stiff_compression: T,
    /// What the energy has more there than k (l - L)^2 / 2 \[J\].
    pub stiff_energy: T,
}

impl<T: Real> Buckling<T> {
    /// A spring that never buckles, for those that stand beside some that do.
    #[inline(always)]
    #[must_use]
    pub fn never() -> Self {
        Self {
            force_scale: T::from_f64(f64::INFINITY),
            // Makes u zero and so, with the scale, the buckled tension minus infinity.
            inverse_rest_length: T::ZERO,
            energy_offset: T::ZERO,
            stiff_compression: T::from_f64(2.0),
            stiff_energy: T::ZERO,
        }
    }

    /// u = max(-(l - L) (1/L), 0), at most 1 but for rounding.
    #[inline(always)]
    fn compression(&self, stretch: T) -> T {
        (-(stretch * self.inverse_rest_length)).maximum(T::ZERO)
    }

    /// The tension of the buckled branch \[N\], which is negative.
    #[inline(always)]
    fn buckled(&self, compression: T) -> T {
        self.force_scale * polynomial(compression, BUCKLING_COEFFICIENTS)
    }

    /// Elastic tension \[N\]: the larger of k (l - L) and that of the buckled branch.
    #[inline(always)]
    #[must_use]
    pub fn tension(&self, stiffness: T, stretch: T) -> T {
        // A stretch that is NaN stays visible: the second number is the answer then.
        self.buckled(self.compression(stretch)).maximum(stiffness * stretch)
    }

    /// Derivative of [`Self::tension`] by the length \[N/m\], positive.
    #[inline(always)]
    #[must_use]
    pub fn tension_derivative(&self, stiffness: T, stretch: T) -> T {
        let compression = self.compression(stretch);
        if self.buckled(compression) > stiffness * stretch {
            let slope = -polynomial(compression, derivative(BUCKLING_COEFFICIENTS));
            self.force_scale * self.inverse_rest_length * slope
        } else {
            stiffness
        }
    }

    /// Elastic energy \[J\], the integral of the tension from the rest length on.
    #[inline(always)]
    #[must_use]
    pub fn energy(&self, stiffness: T, stretch: T) -> T {
        let compression = self.compression(stretch);
        let work =
            self.force_scale * stretch * polynomial(compression, mean(BUCKLING_COEFFICIENTS));
        let stiff = T::from_f64(0.5) * stiffness * stretch * stretch;
        let offset = if compression > self.stiff_compression { self.stiff_energy } else { T::ZERO };
        if self.buckled(compression) > stiffness * stretch {
            work + self.energy_offset
        } else {
            stiff + offset
        }
    }
}

impl Buckling<f64> {
    /// The same, rounded to the precision of a solver.
    #[must_use]
    pub fn rounded<T: Real>(&self) -> Buckling<T> {
        Buckling {
            force_scale: T::from_f64(self.force_scale),
            inverse_rest_length: T::from_f64(self.inverse_rest_length),
            energy_offset: T::from_f64(self.energy_offset),
            stiff_compression: T::from_f64(self.stiff_compression),
            stiff_energy: T::from_f64(self.stiff_energy),
        }
    }
}

/// c0 + u (c1 + u (c2 + ...)).
#[inline(always)]
pub(super) fn polynomial<T: Real, const N: usize>(u: T, coefficients: [f64; N]) -> T {
    let mut sum = T::from_f64(coefficients[N - 1]);
    for k in (0..N - 1).rev() {
        sum = T::from_f64(coefficients[k]) + u * sum;
    }
    sum
}

/// Coefficients of the derivative.
#[inline(always)]
pub(super) const fn derivative(c: [f64; 6]) -> [f64; 5] {
    [c[1], 2.0 * c[2], 3.0 * c[3], 4.0 * c[4], 5.0 * c[5]]
}

/// Coefficients of the mean over \[0, u\].
#[inline(always)]
pub(super) const fn mean(c: [f64; 6]) -> [f64; 6] {
    [c[0], c[1] / 2.0, c[2] / 3.0, c[3] / 4.0, c[4] / 5.0, c[5] / 6.0]
}
