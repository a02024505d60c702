//! The numbers that stages compute with.

use std::{
    fmt::Debug,
    ops::{Add, AddAssign, Div, Mul, Neg, Sub},
};

/// A number: `f64`, or one that carries a bound of its rounding error, which tests put in its place to know how far a backend
/// may be from it. What only such numbers need does nothing for `f64`.
pub trait Number:
    Copy
    + Debug
    + Default
    + PartialEq
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;

    /// A number that every precision holds.
    fn exact(value: f64) -> Self;

    /// A number that is rounded to the precision of a backend, such as a constant of the model.
    fn rounded(value: f64) -> Self;

    /// Its value.
    fn value(self) -> f64;

    /// Square root of a number that is not negative.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Absolute value.
    #[must_use]
    fn abs(self) -> Self;

    /// The larger one.
    #[must_use]
    fn max(self, other: Self) -> Self;

    /// The smaller one.
    #[must_use]
    fn min(self, other: Self) -> Self;

    /// Length of a vector.
    fn length([x, y, z]: [Self; 3]) -> Self {
        (x * x + y * y + z * z).sqrt()
    }

    /// The sum in double precision of numbers that were computed with this `epsilon`.
    #[must_use]
    fn plus_in_double(self, other: Self, _epsilon: f64) -> Self {
        self + other
    }

    /// Whether rounding with this `epsilon` can decide which of two numbers is smaller.
    fn is_close(self, _other: Self, _epsilon: f64) -> bool {
        false
    }

    /// This number as the value of a function at `argument`, which has this slope there.
    #[must_use]
    fn as_function_of(self, _argument: Self, _slope: f64) -> Self {
        self
    }

    /// This number, where rounding with this `epsilon` may have chosen `other`.
    #[must_use]
    fn or_by_rounding(self, _other: Self, _epsilon: f64) -> Self {
        self
    }
}

impl Number for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    fn exact(value: f64) -> Self {
        value
    }

    fn rounded(value: f64) -> Self {
        value
    }

    fn value(self) -> f64 {
        self
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }

    fn abs(self) -> Self {
        self.abs()
    }

    fn max(self, other: Self) -> Self {
        self.max(other)
    }

    fn min(self, other: Self) -> Self {
        self.min(other)
    }
}
