//! Sums in double precision over lanes, in an order that does not depend on how many of them a register has.

use pulp::Simd;

/// Lanes of a sum over a row.
pub(super) const LANES: usize = 16;

/// to = from.
#[inline(always)]
pub(super) fn widen(from: &[f32], to: &mut [f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = f64::from(*from);
    }
}

/// The sum of all lanes: the second half is added to the first, until one is left.
#[inline(always)]
pub(super) fn tree<const N: usize>(mut lanes: [f64; N]) -> f64 {
    let mut half = N / 2;
    while half > 0 {
        for lane in 0..half {
            lanes[lane] += lanes[lane + half];
        }
        half /= 2;
    }
    lanes[0]
}

/// to += a b.
#[inline(always)]
pub(super) fn add_product<S: Simd>(simd: S, to: &mut S::f64s, a: S::f64s, b: S::f64s) {
    *to = simd.add_f64s(*to, simd.mul_f64s(a, b));
}

/// Products of the entries of two vectors of whole [`LANES`], summed up in lanes.
#[inline(always)]
pub(super) fn products<S: Simd>(simd: S, a: &[S::f64s], b: &[S::f64s]) -> [f64; LANES] {
    // A register has 8 lanes at most, so that all of these are registers.
    let mut sums = [simd.splat_f64s(0.0); LANES];
    let registers = LANES / S::F64_LANES;
    for (a, b) in a.chunks_exact(registers).zip(b.chunks_exact(registers)) {
        for ((sum, a), b) in sums[..registers].iter_mut().zip(a).zip(b) {
            add_product(simd, sum, *a, *b);
        }
    }
    let mut lanes = [0.0; LANES];
    S::as_mut_simd_f64s(&mut lanes).0.copy_from_slice(&sums[..registers]);
    lanes
}
