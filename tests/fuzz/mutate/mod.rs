//! Changes to good inputs, by their structure: tokens and lines of texts, trees of values, elements of XML, numbers in binary files.

pub(crate) mod binary;
pub(crate) mod elements;
pub(crate) mod text;
pub(crate) mod tree;

use fastrand::Rng;

/// An input is at most about so long \[byte\]: what a small file can do is what counts.
pub(crate) const LENGTH: usize = 256 << 10;

/// Whole numbers at the edges of types, and of what programs expect.
pub(crate) const WHOLE: [i64; 22] = [
    0,
    1,
    2,
    3,
    7,
    -1,
    -2,
    100,
    127,
    128,
    255,
    256,
    1000,
    65_535,
    65_536,
    1_000_000,
    i32::MAX as i64,
    i32::MIN as i64,
    u32::MAX as i64,
    u32::MAX as i64 + 1,
    i64::MAX,
    i64::MIN,
];

/// The same of other numbers.
pub(crate) const REAL: [f64; 24] = [
    0.0,
    -0.0,
    0.5,
    1.0,
    -1.0,
    1e-3,
    1e-9,
    1e-30,
    1e-45,
    1e-300,
    5e-324,
    1e3,
    1e6,
    1e9,
    1e20,
    1e38,
    3.5e38,
    1e100,
    1e300,
    f64::MAX,
    -1e300,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

/// One of these.
pub(crate) fn any<'a, T>(rng: &mut Rng, values: &'a [T]) -> &'a T {
    &values[rng.usize(..values.len())]
}

/// How often something is repeated: mostly a few times, at times very often.
pub(crate) fn times(rng: &mut Rng) -> usize {
    match rng.u8(..20) {
        0 => 100_000,
        1 | 2 => 1000,
        3..6 => 30,
        _ => 1 + rng.usize(..3),
    }
}

/// How many changes are made to one input: one or two in most cases, so that many are still accepted.
pub(crate) fn changes(rng: &mut Rng) -> usize {
    match rng.u8(..8) {
        0 => rng.usize(4..12),
        1 => 3,
        2 | 3 => 2,
        _ => 1,
    }
}
