//! Functions of expressions, from IEEE operations in a fixed order.
//!
//! No backend may use its own sine, as each has another. The polynomials are Taylor series, cut where
//! the first term left out is below half an ulp on the reduced range, so that their error can be
//! checked by hand; the reductions subtract multiples of a constant that is split into parts, so that
//! the leading products are exact (Cody and Waite 1980, "Software Manual for the Elementary
//! Functions"). Errors, in single precision: `sine` and `cosine` 1.2e-7 for arguments up to 1e5,
//! beyond that |x| eps (the result stays between -1 and 1); `exponential` 2 ulp; `logarithm` 2 ulp, or
//! 1e-7 close to 1; `power` a relative (2 + |b ln a|) eps. In double precision the same with its eps
//! and arguments up to 1e7.

use crate::Real;

use super::node::{Binary, Unary};

/// Horner's scheme, the highest coefficient first.
#[inline(always)]
fn polynomial<T: Real, const N: usize>(z: T, coefficients: [f64; N]) -> T {
    let mut sum = T::from_f64(coefficients[0]);
    for coefficient in &coefficients[1..] {
        sum = sum * z + T::from_f64(*coefficient);
    }
    sum
}

/// `value` within [-limit, limit]; NaN stays NaN.
#[inline(always)]
fn bounded<T: Real>(value: T, low: T, high: T) -> T {
    let value = if value > high { high } else { value };
    if value < low { low } else { value }
}

/// Pi/2 in parts: products of the first two with the number of quarter turns are exact.
const HALF_PI: [[f64; 3]; 2] = [
    [1.570_312_5, 4.825_592_041_015_625e-4, 1.267_590_795_056_731_4e-6],
    [1.570_796_325_802_803, 9.920_935_791_635_221e-10, 5.170_182_981_794_105e-19],
];

/// sin x if `quarters` is 0, cos x if it is 1.
#[inline(always)]
fn sine_shifted<T: Real>(x: T, quarters: T) -> T {
    let [first, second, third] = HALF_PI[usize::from(T::IS_DOUBLE)].map(T::from_f64);
    let half = T::from_f64(0.5);
    let turns = (x * T::from_f64(std::f64::consts::FRAC_2_PI) + half).floor();
    let rest = ((x - turns * first) - turns * second) - turns * third;
    let limit = T::from_f64(0.8);
    let rest = bounded(rest, -limit, limit);
    let z = rest * rest;
    let [sine, cosine] = if T::IS_DOUBLE {
        [
            polynomial(
                z,
                [
                    1.0 / 355_687_428_096_000.0,
                    -1.0 / 1_307_674_368_000.0,
                    1.0 / 6_227_020_800.0,
                    -1.0 / 39_916_800.0,
                    1.0 / 362_880.0,
                    -1.0 / 5040.0,
                    1.0 / 120.0,
                    -1.0 / 6.0,
                ],
            ),
            polynomial(
                z,
                [
                    1.0 / 20_922_789_888_000.0,
                    -1.0 / 87_178_291_200.0,
                    1.0 / 479_001_600.0,
                    -1.0 / 3_628_800.0,
                    1.0 / 40_320.0,
                    -1.0 / 720.0,
                    1.0 / 24.0,
                    -0.5,
                ],
            ),
        ]
    } else {
        [
            polynomial(z, [1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0]),
            polynomial(z, [-1.0 / 3_628_800.0, 1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5]),
        ]
    };
    let sine = rest + rest * (z * sine);
    let cosine = T::ONE + z * cosine;
    let quarters = turns + quarters;
    let quarters = quarters - T::from_f64(4.0) * (quarters * T::from_f64(0.25)).floor();
    let is_odd = quarters == T::ONE || quarters == T::from_f64(3.0);
    let value = if is_odd { cosine } else { sine };
    if quarters >= T::from_f64(2.0) { -value } else { value }
}

/// sin x.
#[inline(always)]
pub(super) fn sine<T: Real>(x: T) -> T {
    sine_shifted(x, T::ZERO)
}

/// cos x.
#[inline(always)]
pub(super) fn cosine<T: Real>(x: T) -> T {
    sine_shifted(x, T::ONE)
}

/// ln 2 in parts: products of the first with an exponent are exact.
const LN_2: [[f64; 2]; 2] = [
    [0.693_145_751_953_125, 1.428_606_820_309_417_3e-6],
    [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10],
];

/// Where e^x leaves the range of the precision, on either side.
const EXPONENTS: [[f64; 2]; 2] = [[-104.0, 89.0], [-746.0, 710.0]];

/// e^x.
#[inline(always)]
pub(super) fn exponential<T: Real>(x: T) -> T {
    let [low, high] = EXPONENTS[usize::from(T::IS_DOUBLE)].map(T::from_f64);
    let [first, second] = LN_2[usize::from(T::IS_DOUBLE)].map(T::from_f64);
    let x = bounded(x, low, high);
    let doublings = (x * T::from_f64(std::f64::consts::LOG2_E) + T::from_f64(0.5)).floor();
    let rest = (x - doublings * first) - doublings * second;
    let series = if T::IS_DOUBLE {
        polynomial(
            rest,
            [
                1.0 / 6_227_020_800.0,
                1.0 / 479_001_600.0,
                1.0 / 39_916_800.0,
                1.0 / 3_628_800.0,
                1.0 / 362_880.0,
                1.0 / 40_320.0,
                1.0 / 5040.0,
                1.0 / 720.0,
                1.0 / 120.0,
                1.0 / 24.0,
                1.0 / 6.0,
                0.5,
                1.0,
                1.0,
            ],
        )
    } else {
        polynomial(
            rest,
            [1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0],
        )
    };
    // In two factors, as the whole one can lie outside of the range where the result does not.
    let exponent = doublings.floor_to_i32();
    let half = exponent >> 1;
    series * T::power_of_two(half) * T::power_of_two(exponent - half)
}

/// ln x; minus infinity for zero and subnormal numbers, NaN below zero.
#[inline(always)]
pub(super) fn logarithm<T: Real>(x: T) -> T {
    let [first, second] = LN_2[usize::from(T::IS_DOUBLE)].map(T::from_f64);
    let (significand, exponent) = x.significand_exponent();
    let is_high = significand > T::from_f64(std::f64::consts::SQRT_2);
    let significand = if is_high { significand * T::from_f64(0.5) } else { significand };
    let exponent = T::from_f64(f64::from(if is_high { exponent + 1 } else { exponent }));
    let s = (significand - T::ONE) / (significand + T::ONE);
    let z = s * s;
    let series = if T::IS_DOUBLE {
        polynomial(
            z,
            [
                1.0 / 19.0,
                1.0 / 17.0,
                1.0 / 15.0,
                1.0 / 13.0,
                1.0 / 11.0,
                1.0 / 9.0,
                1.0 / 7.0,
                1.0 / 5.0,
                1.0 / 3.0,
            ],
        )
    } else {
        polynomial(z, [1.0 / 9.0, 1.0 / 7.0, 1.0 / 5.0, 1.0 / 3.0])
    };
    let double = s + s;
    let value = exponent * first + (double + (double * (z * series) + exponent * second));
    let value = if x >= T::MIN_POSITIVE { value } else { -T::INFINITY };
    // Infinity, and NaN by the failed comparison.
    let value = if x <= T::MAX { value } else { x };
    if x < T::ZERO { T::NAN } else { value }
}

/// a^b; 1 for b = 0, NaN for a below zero.
#[inline(always)]
pub(super) fn power<T: Real>(a: T, b: T) -> T {
    let value = exponential(b * logarithm(a));
    if b == T::ZERO { T::ONE } else { value }
}

/// Any function of one scalar.
#[inline(always)]
pub(super) fn unary<T: Real>(function: Unary, a: T) -> T {
    match function {
        Unary::Negate => -a,
        Unary::Absolute => a.abs(),
        Unary::SquareRoot => a.sqrt(),
        Unary::Sine => sine(a),
        Unary::Cosine => cosine(a),
        Unary::Exponential => exponential(a),
        Unary::Logarithm => logarithm(a),
    }
}

/// Any function of two scalars.
#[inline(always)]
pub(super) fn binary<T: Real>(function: Binary, a: T, b: T) -> T {
    match function {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => a / b,
        Binary::Power => power(a, b),
        Binary::Minimum => a.minimum(b),
        Binary::Maximum => a.maximum(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(low: f64, high: f64) -> impl Iterator<Item = f64> {
        (0..=200_000).map(move |i| low + (high - low) * f64::from(i) / 200_000.0)
    }

    /// Largest error of `found` where `wanted` is the truth, absolute or in units of the truth.
    fn worst<T: Real>(
        [low, high]: [f64; 2],
        found: impl Fn(T) -> T,
        wanted: impl Fn(f64) -> f64,
        relative: bool,
    ) -> f64 {
        values(low, high).fold(0.0, |worst, x| {
            let x = T::from_f64(x);
            let truth = wanted(x.to_f64());
            let error = (found(x).to_f64() - truth).abs();
            f64::max(worst, if relative { error / truth.abs() } else { error })
        })
    }

    #[test]
    fn sine_and_cosine_keep_their_bounds() {
        for range in [[-4.0, 4.0], [-100.0, 100.0], [-1e5, 1e5]] {
            assert!(worst(range, sine::<f32>, f64::sin, false) < 1.2e-7, "{range:?}");
            assert!(worst(range, cosine::<f32>, f64::cos, false) < 1.2e-7, "{range:?}");
            assert!(worst(range, sine::<f64>, f64::sin, false) < 2.3e-16, "{range:?}");
            assert!(worst(range, cosine::<f64>, f64::cos, false) < 2.3e-16, "{range:?}");
        }
        assert!(worst([-1e7, 1e7], sine::<f64>, f64::sin, false) < 2.3e-16);
        assert!(worst([1e-9, 1e-3], sine::<f32>, f64::sin, true) < 1.2e-7, "small ones relatively");
    }

    #[test]
    fn far_out_they_stay_within_one_and_infinity_gives_nan() {
        for x in [1e9_f32, -3e30, f32::MAX] {
            assert!(sine(x).abs() <= 1.0 && cosine(x).abs() <= 1.0);
        }
        assert!(sine(f32::INFINITY).is_nan() && cosine(f64::NAN).is_nan());
    }

    #[test]
    fn exponential_keeps_its_bound_up_to_the_ends_of_the_range() {
        assert!(worst([-87.0, 88.7], exponential::<f32>, f64::exp, true) < 2.4e-7);
        assert!(worst([-1.0, 1.0], exponential::<f32>, f64::exp, true) < 1.8e-7);
        assert!(worst([-708.0, 709.7], exponential::<f64>, f64::exp, true) < 4.5e-16);
        assert_eq!(exponential(1000.0_f32), f32::INFINITY);
        assert_eq!(exponential(f64::INFINITY), f64::INFINITY);
        assert_eq!((exponential(-1000.0_f32), exponential(f64::NEG_INFINITY)), (0.0, 0.0));
        assert_eq!(exponential(0.0_f32), 1.0);
        assert!(exponential(f32::NAN).is_nan());
    }

    #[test]
    fn logarithm_keeps_its_bound_also_close_to_one() {
        assert!(worst([1e-30, 1e-3], logarithm::<f32>, f64::ln, true) < 2.4e-7);
        assert!(worst([1.5, 1e30], logarithm::<f32>, f64::ln, true) < 2.4e-7);
        assert!(worst([0.5, 2.0], logarithm::<f32>, f64::ln, false) < 1e-7);
        assert!(worst([0.5, 2.0], logarithm::<f64>, f64::ln, false) < 2.3e-16);
        assert!(worst([1.5, 1e9], logarithm::<f64>, f64::ln, true) < 4.5e-16);
        assert_eq!(logarithm(1.0_f32), 0.0);
        assert_eq!(
            (logarithm(0.0_f32), logarithm(f64::INFINITY)),
            (f32::NEG_INFINITY, f64::INFINITY)
        );
        assert!(logarithm(-1.0_f32).is_nan() && logarithm(f64::NAN).is_nan());
    }

    #[test]
    fn powers_of_zero_and_of_negative_numbers_are_defined() {
        assert_eq!((power(0.0_f32, 2.5), power(0.0_f32, 0.0)), (0.0, 1.0));
        assert_eq!(power(0.0_f64, -1.5), f64::INFINITY);
        assert!(power(-2.0_f32, 1.5).is_nan());
        assert!((power(2.0_f64, 0.5) - std::f64::consts::SQRT_2).abs() < 1e-15);
    }
}
