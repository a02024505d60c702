//! The two precisions that solvers compute in.

use std::{
    fmt::{Debug, Display},
    ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign},
};

/// A floating point number, `f32` or `f64`.
///
/// Kernels written over it use IEEE operations alone, one rounding each, so that the same code
/// gives the same bits at every vector width.
pub trait Real:
    Copy
    + Default
    + PartialOrd
    + Debug
    + Display
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Lengths below this count as this in a division, so that coinciding particles give finite
    /// forces (NUMERICS §2).
    const LENGTH_MIN: Self;
    /// Distance between 1 and the next larger number.
    const EPSILON: Self;
    /// The largest finite number.
    const MAX: Self;
    /// The smallest positive number that is not subnormal.
    const MIN_POSITIVE: Self;
    /// Positive infinity.
    const INFINITY: Self;
    /// Not a number.
    const NAN: Self;
    /// Whether it has double precision.
    const IS_DOUBLE: bool;
    /// Nearest representable number.
    fn from_f64(value: f64) -> Self;
    /// Exact conversion.
    fn to_f64(self) -> f64;
    /// Correctly rounded square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Absolute value.
    #[must_use]
    fn abs(self) -> Self;
    /// Largest integer not above, as an integer; saturates.
    fn floor_to_i32(self) -> i32;
    /// Largest integer not above, as a floating point number.
    #[must_use]
    fn floor(self) -> Self;
    /// 2^exponent, for an exponent of normal numbers.
    fn power_of_two(exponent: i32) -> Self;
    /// m in [1, 2) and e with self = m 2^e, for a positive normal number.
    fn significand_exponent(self) -> (Self, i32);
    /// Whether it is neither infinite nor NaN.
    fn is_finite(self) -> bool;

    /// The larger of two numbers; `other` if `self` is NaN.
    #[inline(always)]
    #[must_use]
    fn maximum(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The smaller of two numbers; `other` if `self` is NaN.
    #[inline(always)]
    #[must_use]
    fn minimum(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
}

macro_rules! real {
    ($type:ty, $bits:ty, $double:literal) => {
        impl Real for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const LENGTH_MIN: Self = 1e-18;
            const EPSILON: Self = <$type>::EPSILON;
            const MAX: Self = <$type>::MAX;
            const MIN_POSITIVE: Self = <$type>::MIN_POSITIVE;
            const INFINITY: Self = <$type>::INFINITY;
            const NAN: Self = <$type>::NAN;
            const IS_DOUBLE: bool = $double;

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $type
            }

            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                <$type>::sqrt(self)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                <$type>::abs(self)
            }

            #[inline(always)]
            fn floor_to_i32(self) -> i32 {
                // Truncation rounds negative numbers up; one comparison mends that.
                let truncated = self as i32;
                truncated.saturating_sub(i32::from((truncated as $type) > self))
            }

            #[inline(always)]
            fn floor(self) -> Self {
                <$type>::floor(self)
            }

            #[inline(always)]
            fn power_of_two(exponent: i32) -> Self {
                let biased = exponent + (<$type>::MAX_EXP - 1);
                <$type>::from_bits((biased as $bits) << (<$type>::MANTISSA_DIGITS - 1))
            }

            #[inline(always)]
            fn significand_exponent(self) -> (Self, i32) {
                let fraction = (1 << (<$type>::MANTISSA_DIGITS - 1)) - 1;
                let bits = self.to_bits();
                let exponent = (bits >> (<$type>::MANTISSA_DIGITS - 1)) as i32;
                let one = <$type>::to_bits(1.0);
                (<$type>::from_bits((bits & fraction) | one), exponent - (<$type>::MAX_EXP - 1))
            }

            #[inline(always)]
            fn is_finite(self) -> bool {
                <$type>::is_finite(self)
            }
        }
    };
}

real!(f32, u32, false);
real!(f64, u64, true);
