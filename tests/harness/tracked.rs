//! Numbers that carry a bound of their rounding error.
//!
//! Running error analysis (Wilkinson 1986, "Error analysis revisited"; Higham 2002, "Accuracy and
//! Stability of Numerical Algorithms", section 3.3): every operation adds its own rounding error,
//! |result| eps, to the errors that it passes on from its operands. For a sum this gives the
//! familiar eps times the sum of |contributions|. A computation written on these numbers yields its
//! result in double precision and a bound for what any precision may make of it.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A number with a bound of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tracked {
    /// The number.
    pub value: f64,
    /// Bound of its error in units of eps, of first order.
    pub error: f64,
}

impl Tracked {
    /// A number that every precision under test holds exactly, such as a rounded input.
    #[must_use]
    pub const fn exact(value: f64) -> Self {
        Self { value, error: 0.0 }
    }

    /// A number that a backend rounds to its precision, such as a constant of the model.
    #[must_use]
    pub const fn rounded(value: f64) -> Self {
        Self { value, error: value.abs() }
    }

    /// Square root of a number that is not negative.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        if self.error == 0.0 {
            return Self::rounded(value);
        }
        Self { value, error: self.error / (2.0 * value) + value }
    }

    /// The sum in double precision of two numbers that were computed with this `epsilon`.
    #[must_use]
    pub fn plus_in_double(self, other: Self, epsilon: f64) -> Self {
        let value = self.value + other.value;
        let rounding = value.abs() * (f64::EPSILON / epsilon);
        Self { value, error: self.error + other.error + rounding }
    }

    /// Absolute value.
    #[must_use]
    pub const fn abs(self) -> Self {
        Self { value: self.value.abs(), error: self.error }
    }

    /// The larger one. Either can turn out to be it, so that the larger error counts.
    #[must_use]
    pub const fn max(self, other: Self) -> Self {
        Self { value: self.value.max(other.value), error: self.error.max(other.error) }
    }

    /// The smaller one; see [`Self::max`].
    #[must_use]
    pub const fn min(self, other: Self) -> Self {
        Self { value: self.value.min(other.value), error: self.error.max(other.error) }
    }

    /// Whether rounding with this `epsilon` can decide which of two numbers is smaller.
    #[must_use]
    pub fn is_close(self, other: Self, epsilon: f64) -> bool {
        let margin = crate::backends::SAFETY * epsilon * (self.error + other.error);
        (self.value - other.value).abs() <= margin
    }
}

impl Add for Tracked {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let value = self.value + other.value;
        Self { value, error: self.error + other.error + value.abs() }
    }
}

impl Sub for Tracked {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Tracked {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let value = self.value * other.value;
        let passed_on = self.value.abs() * other.error + other.value.abs() * self.error;
        Self { value, error: passed_on + value.abs() }
    }
}

impl Div for Tracked {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let passed_on = (self.error + value.abs() * other.error) / other.value.abs();
        Self { value, error: passed_on + value.abs() }
    }
}

impl Neg for Tracked {
    type Output = Self;

    fn neg(self) -> Self {
        Self { value: -self.value, error: self.error }
    }
}

impl AddAssign for Tracked {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Three of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackedVector(pub [Tracked; 3]);

impl TrackedVector {
    /// Zero.
    pub const ZERO: Self = Self([Tracked::exact(0.0); 3]);

    /// See [`Tracked::exact`].
    #[must_use]
    pub fn exact(vector: [f64; 3]) -> Self {
        Self(vector.map(Tracked::exact))
    }

    /// See [`Tracked::rounded`].
    #[must_use]
    pub fn rounded(vector: [f64; 3]) -> Self {
        Self(vector.map(Tracked::rounded))
    }

    /// The vector without the errors.
    #[must_use]
    pub fn values(self) -> [f64; 3] {
        self.0.map(|component| component.value)
    }

    /// Scalar product, summed from left to right.
    #[must_use]
    pub fn dot(self, other: Self) -> Tracked {
        let [x, y, z] = self.each(other, Mul::mul).0;
        x + y + z
    }

    /// Vector product.
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// Length. The error of a length is at most the length of the error, which, unlike the error of
    /// the square root, stays bounded for a vector that is zero but for rounding.
    #[must_use]
    pub fn length(self) -> Tracked {
        let norm = |part: fn(Tracked) -> f64| self.0.map(part).map(|c| c * c).iter().sum::<f64>();
        let value = norm(|component| component.value).sqrt();
        // Squares, their sum and the root: two operations on the squares are one on the root.
        Tracked { value, error: norm(|component| component.error).sqrt() + 3.0 * value }
    }

    /// Every component times `factor`.
    #[must_use]
    pub fn scaled(self, factor: Tracked) -> Self {
        Self(self.0.map(|component| component * factor))
    }

    /// Every component divided by `divisor`.
    #[must_use]
    pub fn divided(self, divisor: Tracked) -> Self {
        Self(self.0.map(|component| component / divisor))
    }

    /// `operation` component by component.
    #[must_use]
    pub fn each(self, other: Self, operation: impl Fn(Tracked, Tracked) -> Tracked) -> Self {
        Self(std::array::from_fn(|k| operation(self.0[k], other.0[k])))
    }
}

impl Add for TrackedVector {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.each(other, Add::add)
    }
}

impl Sub for TrackedVector {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.each(other, Sub::sub)
    }
}

impl AddAssign for TrackedVector {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for TrackedVector {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn single_precision_stays_within_the_bound() {
        // The same expression in f32; its inputs are f32 numbers.
        let mut random = Random::new(1);
        for _ in 0..10_000 {
            let [a, b, c, d] = std::array::from_fn(|_| random.between(-2.0, 2.0) as f32);
            let single = ((a + b) * c - d) / (c * c + a * a).sqrt();
            let [a, b, c, d] = [a, b, c, d].map(|value| Tracked::exact(f64::from(value)));
            let tracked = ((a + b) * c - d) / (c * c + a * a).sqrt();
            let error = (f64::from(single) - tracked.value).abs();
            assert!(error <= f64::from(f32::EPSILON) * tracked.error);
        }
    }

    #[test]
    fn the_bound_of_a_sum_is_the_sum_of_the_contributions() {
        let terms = [1.0, -1.0, 0.5].map(Tracked::rounded);
        let sum = terms[0] + terms[1] + terms[2];
        assert_eq!(sum.value, 0.5);
        assert_eq!(sum.error, 2.5 + 0.0 + 0.5, "three rounded terms, two additions");
    }
}
