//! Vectors of three numbers.

use std::ops::{Add, AddAssign, Mul, Sub, SubAssign};

use crate::Number;

/// A vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector<N>(pub [N; 3]);

impl<N: Number> Vector<N> {
    /// Zero.
    pub const ZERO: Self = Self([N::ZERO; 3]);

    /// See [`Number::exact`].
    #[must_use]
    pub fn exact(vector: [f64; 3]) -> Self {
        Self(vector.map(N::exact))
    }

    /// See [`Number::rounded`].
    #[must_use]
    pub fn rounded(vector: [f64; 3]) -> Self {
        Self(vector.map(N::rounded))
    }

    /// The unit vector along an axis.
    #[must_use]
    pub fn axis(axis: usize) -> Self {
        Self::exact(std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 }))
    }

    /// The values of its components.
    #[must_use]
    pub fn values(self) -> [f64; 3] {
        self.0.map(N::value)
    }

    /// Scalar product, summed from left to right.
    #[must_use]
    pub fn dot(self, other: Self) -> N {
        let [x, y, z] = self.each(other, Mul::mul).0;
        x + y + z
    }

    /// Vector product.
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// Length.
    #[must_use]
    pub fn length(self) -> N {
        N::length(self.0)
    }

    /// Every component times `factor`.
    #[must_use]
    pub fn scaled(self, factor: N) -> Self {
        Self(self.0.map(|component| component * factor))
    }

    /// Every component divided by `divisor`.
    #[must_use]
    pub fn divided(self, divisor: N) -> Self {
        Self(self.0.map(|component| component / divisor))
    }

    /// `operation` component by component.
    #[must_use]
    pub fn each(self, other: Self, operation: impl Fn(N, N) -> N) -> Self {
        Self(std::array::from_fn(|k| operation(self.0[k], other.0[k])))
    }

    /// What it has along a plane with this normal.
    #[must_use]
    pub fn along_plane(self, normal: Self) -> Self {
        self - normal.scaled(self.dot(normal))
    }
}

impl<N: Number> Add for Vector<N> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.each(other, Add::add)
    }
}

impl<N: Number> Sub for Vector<N> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.each(other, Sub::sub)
    }
}

impl<N: Number> AddAssign for Vector<N> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<N: Number> SubAssign for Vector<N> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
