//! What stands for several times.

/// The sample that has a share of the others below it, from 0 for the least to 1 for the greatest; between two samples the value in
/// proportion between theirs (Hyndman and Fan 1996, definition 7), so that the median of an even number is the mean of the two in the middle.
/// Zero if there is no sample; sorts the samples.
fn quantile(samples: &mut [f64], share: f64) -> f64 {
    samples.sort_by(f64::total_cmp);
    let Some(last) = samples.len().checked_sub(1) else { return 0.0 };
    let position = last as f64 * share.clamp(0.0, 1.0);
    let [below, above] = [position.floor(), position.ceil()].map(|index| samples[index as usize]);
    below + (above - below) * position.fract()
}

/// The sample in the middle; the mean of two of an even number, zero of none. Sorts the samples.
pub fn median(samples: &mut [f64]) -> f64 {
    quantile(samples, 0.5)
}

/// First quartile, median and third quartile.
pub fn quartiles(samples: &mut [f64]) -> [f64; 3] {
    [0.25, 0.5, 0.75].map(|share| quantile(samples, share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_of_nine_are_the_third_and_the_seventh() {
        let mut samples: Vec<f64> = (1..=9).rev().map(f64::from).collect();
        assert_eq!(quartiles(&mut samples), [3.0, 5.0, 7.0]);
    }

    #[test]
    fn the_median_of_an_even_number_is_between_two() {
        assert_eq!(median(&mut [4.0, 1.0, 10.0, 2.0]), 3.0);
        assert_eq!(quantile(&mut [2.0, 4.0], 0.25), 2.5);
    }

    #[test]
    fn ends_are_the_least_and_the_greatest() {
        let mut samples = [3.0, 1.0, 2.0];
        assert_eq!([0.0, 1.0, 7.0].map(|share| quantile(&mut samples, share)), [1.0, 3.0, 3.0]);
        assert_eq!(median(&mut [8.0]), 8.0);
        assert_eq!(median(&mut []), 0.0);
    }
}
