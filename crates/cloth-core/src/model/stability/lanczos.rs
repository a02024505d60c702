//! The largest eigenvalue of a matrix that can be multiplied by.

/// Probability with which the bound is too small.
const MISS_PROBABILITY: f64 = 1e-6;

/// Share of its largest entry below which a new direction is rounding: there is none left.
const EXHAUSTED: f64 = 1e-12;

/// An upper bound of the largest eigenvalue of a symmetric matrix of `size` rows without negative
/// eigenvalues, by `steps` steps of the Lanczos iteration at most; zero for one without rows.
///
/// The start is random, in every direction alike. Then the estimate falls short of the eigenvalue by a relative
/// error of e or more with a probability of at most 1.648 sqrt(n) exp(-sqrt(e) (2 k - 1)) after k steps, whatever the
/// matrix is (Kuczyński and Woźniakowski 1992): e is chosen so that this is 1e-6. A single
/// light particle is not missed, as an iteration from a chosen start could do: what stands out is found first.
pub(super) fn largest_eigenvalue(
    size: usize,
    steps: usize,
    mut apply: impl FnMut(&[f64], &mut [f64]),
) -> f64 {
    let mut vector = random_direction(size);
    let mut before = vec![0.0; size];
    let mut image = vec![0.0; size];
    let mut diagonal: Vec<f64> = Vec::with_capacity(steps);
    let mut beside: Vec<f64> = Vec::with_capacity(steps);
    let mut is_exact = size == 0;
    while diagonal.len() < steps && !is_exact {
        apply(&vector, &mut image);
        let along = dot(&vector, &image);
        let last = beside.last().copied().unwrap_or(0.0);
        for ((image, vector), before) in image.iter_mut().zip(&vector).zip(&before) {
            *image -= along * vector + last * before;
        }
        diagonal.push(along);
        let rest = dot(&image, &image).sqrt();
        if !rest.is_finite() {
            return f64::INFINITY;
        }
        let scale = diagonal.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
        is_exact = rest <= EXHAUSTED * scale || diagonal.len() >= size;
        beside.push(rest);
        std::mem::swap(&mut before, &mut vector);
        vector.iter_mut().zip(&image).for_each(|(vector, image)| *vector = image / rest);
    }
    let estimate = tridiagonal_largest(&diagonal, &beside);
    if is_exact {
        // But for rounding, and where eigenvalues coincide, the iteration ends early.
        return estimate * (1.0 + 1e-9);
    }
    let products = 2.0 * diagonal.len() as f64 - 1.0;
    let error = ((1.648 * (size as f64).sqrt() / MISS_PROBABILITY).ln() / products).powi(2);
    estimate / (1.0 - error.min(0.5))
}

/// The largest eigenvalue of a symmetric tridiagonal matrix, by bisection: as many eigenvalues are above a number
/// as the factorisation without it has positive pivots (Sturm).
fn tridiagonal_largest(diagonal: &[f64], beside: &[f64]) -> f64 {
    let around = |at: usize| {
        let left = if at > 0 { beside[at - 1] } else { 0.0 };
        let right = if at + 1 < diagonal.len() { beside[at] } else { 0.0 };
        diagonal[at] + left + right
    };
    let mut high = (0..diagonal.len()).map(around).fold(0.0, f64::max);
    let mut low = diagonal.iter().copied().fold(0.0, f64::max);
    let is_above_all = |number: f64| {
        let mut pivot = 1.0;
        diagonal.iter().enumerate().all(|(at, entry)| {
            let square = if at > 0 { beside[at - 1] * beside[at - 1] } else { 0.0 };
            pivot = number - entry - square / pivot;
            pivot > 0.0
        })
    };
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return high;
        }
        if is_above_all(middle) { high = middle } else { low = middle }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A vector of length one, evenly distributed over the sphere, always the same: its entries are normal (Box and Muller
/// 1958) from the bits of `SplitMix64` (Steele, Lea and Flood 2014).
fn random_direction(size: usize) -> Vec<f64> {
    let mut state = 0_u64;
    let mut unit = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut vector: Vec<f64> = (0..size)
        .map(|_| {
            let radius = (-2.0 * (1.0 - unit()).ln()).sqrt();
            radius * (std::f64::consts::TAU * unit()).cos()
        })
        .collect();
    let length = dot(&vector, &vector).sqrt();
    vector.iter_mut().for_each(|entry| *entry /= length);
    vector
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_diagonal(values: &[f64], steps: usize) -> f64 {
        largest_eigenvalue(values.len(), steps, |x, y| {
            for ((y, x), value) in y.iter_mut().zip(x).zip(values) {
                *y = value * x;
            }
        })
    }

    #[test]
    fn one_entry_among_many_is_found() {
        for place in [0, 1234, 9999] {
            let mut values = vec![1.0; 10_000];
            values.iter_mut().enumerate().for_each(|(i, value)| *value += 1e-4 * i as f64);
            values[place] = 40.0;
            let found = of_diagonal(&values, 24);
            assert!((40.0..60.0).contains(&found), "{found}");
        }
    }

    #[test]
    fn the_bound_is_above_the_eigenvalue_and_close_to_it() {
        // The spectrum of a long chain, whose largest eigenvalues lie close together.
        let values: Vec<f64> = (0..20_000)
            .map(|i| 2.0 - 2.0 * (f64::from(i) / 2e4 * std::f64::consts::PI).cos())
            .collect();
        for (steps, largest) in [(24, 4.9), (64, 4.1)] {
            let found = of_diagonal(&values, steps);
            assert!((4.0..largest).contains(&found), "{steps}: {found}");
        }
    }

    #[test]
    fn small_matrices_are_exact() {
        assert_eq!(of_diagonal(&[], 64), 0.0);
        assert_eq!(of_diagonal(&[0.0; 5], 64), 0.0);
        for values in [&[3.0][..], &[3.0, 3.0], &[1.0, 5.0, 2.0]] {
            let largest = values.iter().copied().fold(0.0, f64::max);
            let found = of_diagonal(values, 64);
            assert!((found / largest - 1.0).abs() < 1e-6, "{values:?}: {found}");
        }
    }
}
