//! From a measured curve of force over strain to the curve of the elastic law.

use super::{FabricError, TensileCurve};

/// A point of a measured tensile curve: strip biaxial, which keeps the other threads' length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TensileSample {
    /// Elongation per length, l/L - 1.
    pub strain: f64,
    /// Force per width of the strip \[N/m\].
    pub force: f64,
}

/// A fitted curve and how far it is from what was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TensileFit {
    /// The curve.
    pub curve: TensileCurve,
    /// Root of the mean square of the deviation in force, relative to the largest force.
    pub mean_deviation: f64,
    /// Largest deviation in force, relative to the largest force.
    pub largest_deviation: f64,
    /// Work of the stretch as measured and as fitted \[J/m^2\].
    pub work: [f64; 2],
}

/// The slope at rest is at least this share of the mean slope: a thread that resists nothing at first would leave the law without
/// a positive slope.
const LEAST_SLOPE: f64 = 0.01;

impl TensileFit {
    /// The curve k1 E + k3 E^3, k1 > 0, k3 >= 0, whose force has the least mean square deviation over strain.
    ///
    /// With strain e the Green strain is E = e + e^2/2, and the stress S = F / (1 + e), as F is the force per width at rest.
    ///
    /// # Errors
    /// A curve with fewer than two points, that does not rise, or whose strains are not ascending.
    pub fn new(samples: &[TensileSample], owner: &str) -> Result<Self, FabricError> {
        let refuse = |problem: String| FabricError::TensileCurve { owner: owner.into(), problem };
        for (i, sample) in samples.iter().enumerate() {
            let TensileSample { strain, force } = *sample;
            let is_number =
                strain.is_finite() && force.is_finite() && strain >= 0.0 && force >= 0.0;
            if !is_number {
                return Err(refuse(format!(
                    "point {i} is ({strain}, {force}): give strain and force per width of a stretch, neither below zero"
                )));
            }
        }
        for (i, pair) in samples.windows(2).enumerate() {
            if pair[1].strain <= pair[0].strain {
                return Err(refuse(format!(
                    "point {} has strain {} after {}: sort the points, each strain once, and take the loading part alone",
                    i + 1,
                    pair[1].strain,
                    pair[0].strain
                )));
            }
            if pair[1].force < pair[0].force {
                return Err(refuse(format!(
                    "the force falls from {} to {} N/m at point {}: a law that softens is not stable; leave out what comes after the \
                     largest force",
                    pair[0].force,
                    pair[1].force,
                    i + 1
                )));
            }
        }
        let last = match samples {
            [_, .., last] if last.force > 0.0 => *last,
            _ => {
                return Err(refuse(
                    "give at least two points, the last with a force above zero".to_owned(),
                ));
            }
        };
        let points: Vec<Point> = points(samples);
        let end = green(last.strain);
        let secant = last.force / (1.0 + last.strain) / end;
        let mut linear = 0.0;
        let mut cubic = -1.0;
        let sum = |f: &dyn Fn(&Point) -> f64| points.iter().map(f).sum::<f64>();
        let [a11, a12, a22] =
            [sum(&|p| p.weight * p.row[0] * p.row[0]), sum(&|p| p.weight * p.row[0] * p.row[1]), {
                sum(&|p| p.weight * p.row[1] * p.row[1])
            }];
        let [b1, b2] =
            [sum(&|p| p.weight * p.row[0] * p.force), sum(&|p| p.weight * p.row[1] * p.force)];
        let determinant = a11 * a22 - a12 * a12;
        if determinant > 1e-12 * a11 * a22 {
            linear = (b1 * a22 - b2 * a12) / determinant;
            cubic = (b2 * a11 - b1 * a12) / determinant;
        }
        if cubic < 0.0 {
            (linear, cubic) = (b1 / a11, 0.0);
        }
        if linear < LEAST_SLOPE * secant {
            linear = LEAST_SLOPE * secant;
            cubic = ((b2 - linear * a12) / a22).max(0.0);
        }
        let curve = TensileCurve { linear, cubic, end };
        Ok(Self::report(curve, &points, last.force))
    }

    fn report(curve: TensileCurve, points: &[Point], largest: f64) -> Self {
        let model = |p: &Point| curve.linear * p.row[0] + curve.cubic * p.row[1];
        let mut fit = Self { curve, mean_deviation: 0.0, largest_deviation: 0.0, work: [0.0; 2] };
        let mut width = 0.0;
        for point in points {
            let deviation = (model(point) - point.force) / largest;
            fit.mean_deviation += point.weight * deviation * deviation;
            fit.largest_deviation = fit.largest_deviation.max(deviation.abs());
            fit.work[0] += point.weight * point.force;
            fit.work[1] += point.weight * model(point);
            width += point.weight;
        }
        fit.mean_deviation = (fit.mean_deviation / width).sqrt();
        fit
    }
}

/// A sample as a row of the least squares: force = k1 row\[0\] + k3 row\[1\].
#[derive(Clone, Copy, Debug)]
struct Point {
    row: [f64; 2],
    force: f64,
    /// Strain that it stands for, by the trapezoidal rule.
    weight: f64,
}

fn green(strain: f64) -> f64 {
    strain + 0.5 * strain * strain
}

fn points(samples: &[TensileSample]) -> Vec<Point> {
    // Every curve starts at rest, whether that was written down or not.
    let rest = TensileSample { strain: 0.0, force: 0.0 };
    let start = (samples[0].strain > 0.0).then_some(rest);
    let all: Vec<_> = start.into_iter().chain(samples.iter().copied()).collect();
    let gap = |i: usize| all[i + 1].strain - all[i].strain;
    let point = |(i, sample): (usize, &TensileSample)| {
        let before = if i > 0 { gap(i - 1) } else { 0.0 };
        let after = if i + 1 < all.len() { gap(i) } else { 0.0 };
        let e = green(sample.strain);
        let stretch = 1.0 + sample.strain;
        Point {
            row: [stretch * e, stretch * e * e * e],
            force: sample.force,
            weight: 0.5 * (before + after),
        }
    };
    all.iter().enumerate().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(force: impl Fn(f64) -> f64, largest: f64) -> Vec<TensileSample> {
        (0..=40)
            .map(|i| largest * f64::from(i) / 40.0)
            .map(|strain| TensileSample { strain, force: force(strain) })
            .collect()
    }

    #[test]
    fn a_curve_of_the_law_is_found_again() {
        let [linear, cubic] = [250.0, 3e4];
        let force = |e: f64| (1.0 + e) * (linear * green(e) + cubic * green(e).powi(3));
        let fit = TensileFit::new(&samples(force, 0.12), "it").unwrap();
        assert!((fit.curve.linear / linear - 1.0).abs() < 1e-9, "{fit:?}");
        assert!((fit.curve.cubic / cubic - 1.0).abs() < 1e-9, "{fit:?}");
        assert!(fit.largest_deviation < 1e-12 && (fit.curve.end - green(0.12)).abs() < 1e-15);
    }

    #[test]
    fn what_bends_the_other_way_becomes_a_line_and_says_so() {
        let fit = TensileFit::new(&samples(|e| 500.0 * e.sqrt(), 0.1), "it").unwrap();
        assert_eq!(fit.curve.cubic, 0.0);
        assert!(fit.largest_deviation > 0.1, "{fit:?}");
        // A thread that is slack at first keeps a slope.
        let slack = TensileFit::new(&samples(|e| 1e6 * e.powi(5), 0.1), "it").unwrap();
        assert!(slack.curve.linear > 0.0 && slack.curve.cubic > 0.0);
    }

    #[test]
    fn curves_that_are_none_are_refused() {
        let point = |strain, force| TensileSample { strain, force };
        for (points, words) in [
            (vec![], "at least two"),
            (vec![point(0.0, 0.0), point(0.1, 0.0)], "above zero"),
            (vec![point(0.1, 5.0), point(0.1, 6.0)], "point 1 has strain 0.1 after 0.1"),
            (vec![point(0.1, 5.0), point(0.2, 4.0)], "the force falls"),
            (vec![point(0.1, -5.0), point(0.2, 4.0)], "point 0"),
            (vec![point(0.1, f64::NAN), point(0.2, 4.0)], "point 0"),
        ] {
            let message = TensileFit::new(&points, "it").unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
