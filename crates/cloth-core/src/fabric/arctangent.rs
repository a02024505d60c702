//! The angle of a direction, from IEEE operations alone (NUMERICS §12).

use std::f64::consts::PI;

use crate::Real;

/// atan r = r - r z P(z), z = r^2, |r| <= 7/16, in double precision: coefficients of P (Sun Microsystems 1993, fdlibm, `s_atan.c`).
const DOUBLE: [f64; 11] = [
    3.333_333_333_333_293e-1,
    -1.999_999_999_987_648_3e-1,
    1.428_571_427_250_346_6e-1,
    -1.111_111_040_546_235_6e-1,
    9.090_887_133_436_507e-2,
    -7.691_876_205_044_83e-2,
    6.661_073_137_387_531e-2,
    -5.833_570_133_790_573_5e-2,
    4.976_877_994_615_932_4e-2,
    -3.653_157_274_421_691_6e-2,
    1.628_582_011_536_578_2e-2,
];

/// The same in single precision (`s_atanf.c`).
const SINGLE: [f64; 5] = [
    3.333_332_836_6e-1,
    -1.999_915_838_2e-1,
    1.425_363_570_5e-1,
    -1.064_801_737_7e-1,
    6.168_760_731_8e-2,
];

/// What is left of pi and of atan(1/2) when they are rounded to double precision.
const RESTS: [f64; 2] = [1.224_646_799_147_353_2e-16, 2.269_877_745_296_168_7e-17];

/// atan(1/2).
const HALF_SLOPE: f64 = 0.463_647_609_000_806_1;

/// An angle as its rounded value and what is left of it; `rest` is what double precision leaves.
#[inline(always)]
fn split<T: Real>(angle: f64, rest: f64) -> [T; 2] {
    let rounded = T::from_f64(angle);
    let rest = if T::IS_DOUBLE { rest } else { angle - rounded.to_f64() };
    [rounded, T::from_f64(rest)]
}

#[inline(always)]
fn polynomial<T: Real>(z: T) -> T {
    let horner = |coefficients: &[f64]| {
        coefficients.iter().rev().fold(T::ZERO, |sum, &c| T::from_f64(c) + z * sum)
    };
    if T::IS_DOUBLE { horner(&DOUBLE) } else { horner(&SINGLE) }
}

/// Angle of the direction (x, y) in \[-pi, pi\], within two units in the last place; 0 for x = y = 0. Zeros have no sign here:
/// the angle of (-1, -0) is pi.
#[inline(always)]
#[must_use]
pub fn arctangent2<T: Real>(y: T, x: T) -> T {
    let [ay, ax] = [y.abs(), x.abs()];
    let steep = ay > ax;
    let (small, large) = if steep { (ax, ay) } else { (ay, ax) };
    // tan(a - b) = (tan a - tan b) / (1 + tan a tan b) for tan b = 1/2 and 1; the differences are exact. What is left of the slope is
    // at most 7/16.
    let two = T::from_f64(2.0);
    let (over, under, base) = if small <= T::from_f64(0.4375) * large {
        (small, large, [T::ZERO; 2])
    } else if small <= T::from_f64(0.6875) * large {
        (two * small - large, two * large + small, split(HALF_SLOPE, RESTS[1]))
    } else {
        (small - large, small + large, split(PI / 4.0, RESTS[0] / 4.0))
    };
    let r = if under == T::ZERO { T::ZERO } else { over / under };
    let z = r * r;
    let within = base[0] + ((r - r * (z * polynomial(z))) + base[1]);
    // The octants: angle = a multiple of pi/2 plus or minus what is within.
    let (turn, signed) = match (steep, x < T::ZERO) {
        (false, false) => ([T::ZERO; 2], within),
        (true, false) => (split(PI / 2.0, RESTS[0] / 2.0), -within),
        (true, true) => (split(PI / 2.0, RESTS[0] / 2.0), within),
        (false, true) => (split(PI, RESTS[0]), -within),
    };
    let angle = turn[0] + (signed + turn[1]);
    if y < T::ZERO { -angle } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Units in the last place of a number of 53 or 24 bits.
    fn ulp(value: f64, bits: i32) -> f64 {
        2.0_f64.powi(value.abs().max(1e-300).log2().floor() as i32 - bits + 1)
    }

    #[test]
    fn angles_are_right_to_two_units_in_the_last_place() {
        let mut worst = [0.0_f64; 2];
        // Directions around the circle, dense and with unequal scales.
        for k in 0..400_000_u32 {
            let angle = f64::from(k) * 0.000_157_079_7;
            let scale = 2.0_f64.powi((k % 41) as i32 - 20);
            let (s, c) = angle.sin_cos();
            let [y, x] = [s * scale, c * scale];
            let reference = y.atan2(x);
            worst[0] = worst[0].max((arctangent2(y, x) - reference).abs() / ulp(reference, 53));
            let [y, x] = [y as f32, x as f32];
            let reference = f64::from(y).atan2(f64::from(x));
            let found = f64::from(arctangent2(y, x));
            worst[1] = worst[1].max((found - reference).abs() / ulp(reference, 24));
        }
        assert!(worst[0] <= 2.0 && worst[1] <= 2.0, "{worst:?}");
        assert!(worst[1] > 0.5, "a test that sees no error sees nothing: {worst:?}");
    }

    #[test]
    fn axes_and_tiny_angles_are_exact() {
        use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
        for (y, x, expected) in [
            (0.0, 1.0, 0.0),
            (1.0, 0.0, FRAC_PI_2),
            (0.0, -1.0, PI),
            (-1.0, 0.0, -FRAC_PI_2),
            (1.0, 1.0, FRAC_PI_4),
            (0.0, 0.0, 0.0),
            (1e-200, 1.0, 1e-200),
            (-3e-9, 1.0, -3e-9),
        ] {
            assert_eq!(arctangent2(y, x), expected, "{y} {x}");
        }
        assert!(arctangent2(f64::NAN, 1.0).is_nan() && arctangent2(1.0, f64::NAN).is_nan());
        assert_eq!(arctangent2(1.0_f32, 1.0), std::f32::consts::FRAC_PI_4);
    }
}
