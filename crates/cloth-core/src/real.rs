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
    ($type:ty) => {
        impl Real for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const LENGTH_MIN: Self = 1e-18;
            const EPSILON: Self = <$type>::EPSILON;
            const MAX: Self = <$type>::MAX;

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
            fn is_finite(self) -> bool {
                <$type>::is_finite(self)
            }
        }
    };
}

real!(f32);
real!(f64);
