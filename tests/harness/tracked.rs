//! Numbers that carry a bound of their rounding error.
//!
//! Running error analysis (Wilkinson 1986, "Error analysis revisited"; Higham 2002, "Accuracy and
//! Stability of Numerical Algorithms", section 3.3): every operation adds its own rounding error,
//! |result| eps, to the errors that it passes on from its operands. For a sum this gives the
//! familiar eps times the sum of |contributions|. A computation written on these numbers yields its
//! result in double precision and a bound for what any precision may make of it.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use cloth_backend_reference::{Number, Vector};

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
}

impl Number for Tracked {
    const ZERO: Self = Self::exact(0.0);
    const ONE: Self = Self::exact(1.0);

    fn exact(value: f64) -> Self {
        Self::exact(value)
    }

    fn rounded(value: f64) -> Self {
        Self::rounded(value)
    }

    fn value(self) -> f64 {
        self.value
    }

    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        if self.error == 0.0 {
            return Self::rounded(value);
        }
        Self { value, error: self.error / (2.0 * value) + value }
    }

    fn abs(self) -> Self {
        Self { value: self.value.abs(), error: self.error }
    }

    /// Either can turn out to be the larger one, so that the larger error counts.
    fn max(self, other: Self) -> Self {
        Self { value: self.value.max(other.value), error: self.error.max(other.error) }
    }

    fn min(self, other: Self) -> Self {
        Self { value: self.value.min(other.value), error: self.error.max(other.error) }
    }

    /// The error of a length is at most the length of the error, which, unlike the error of
    /// the square root, stays bounded for a vector that is zero but for rounding.
    fn length(vector: [Self; 3]) -> Self {
        let norm = |part: fn(Self) -> f64| vector.map(part).map(|c| c * c).iter().sum::<f64>();
        let value = norm(|component| component.value).sqrt();
        // Squares, their sum and the root: two operations on the squares are one on the root.
        Self { value, error: norm(|component| component.error).sqrt() + 3.0 * value }
    }

    fn plus_in_double(self, other: Self, epsilon: f64) -> Self {
        let value = self.value + other.value;
        let rounding = value.abs() * (f64::EPSILON / epsilon);
        Self { value, error: self.error + other.error + rounding }
    }

    fn is_close(self, other: Self, epsilon: f64) -> bool {
        let margin = crate::backends::SAFETY * epsilon * (self.error + other.error);
        (self.value - other.value).abs() <= margin
    }

    fn as_function_of(self, argument: Self, slope: f64) -> Self {
        Self { error: self.error + slope.abs() * argument.error, ..self }
    }

    fn or_by_rounding(self, other: Self, epsilon: f64) -> Self {
        let between = (self.value - other.value).abs() / epsilon;
        Self { error: self.error.max(other.error) + between, ..self }
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
pub type TrackedVector = Vector<Tracked>;

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
