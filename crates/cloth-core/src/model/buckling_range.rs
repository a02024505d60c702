//! Where a spring follows its buckled branch (NUMERICS §2).

use super::{
    BUCKLING_COEFFICIENTS, Buckling, SpringKind,
    buckling::{derivative, mean, polynomial},
};

/// Where a spring follows the buckled branch.
struct Range {
    /// The compression at which it buckles.
    onset: f64,
    /// The compression at which it is stiff again, below 1 only for a spring that is nearly too
    /// rigid to buckle.
    end: f64,
}

impl SpringKind {
    /// The compressions at which the buckled branch is the larger one, if there are any.
    fn buckled_range(&self) -> Option<Range> {
        // With rho = B / (k L^3) the branches differ by k L psi, psi(u) = u + rho g(u): first
        // negative, and positive where the spring is buckled. Where rho is small enough for that,
        // psi grows up to its only maximum, which may be at u = 1.
        let rho = self.rigidity? / (self.rest_length.powi(2) * self.rest_length * self.stiffness);
        let psi = |u: f64| u + rho * polynomial(u, BUCKLING_COEFFICIENTS);
        let slope = |u: f64| 1.0 + rho * polynomial(u, derivative(BUCKLING_COEFFICIENTS));
        let top = if slope(1.0) >= 0.0 { 1.0 } else { last_true(|u| slope(u) >= 0.0, [0.0, 1.0]) };
        (psi(top) > 0.0).then(|| Range {
            onset: last_true(|u| psi(u) <= 0.0, [0.0, top]),
            end: if psi(1.0) > 0.0 { 1.0 } else { last_true(|u| psi(u) > 0.0, [top, 1.0]) },
        })
    }

    /// What its rigidity does, or `None` for a spring that never buckles: without rigidity, or with
    /// one above 0.0319 k L^3, where k (l - L) is the weaker force at every length.
    #[must_use]
    pub fn buckling(&self) -> Option<Buckling<f64>> {
        let range = self.buckled_range()?;
        let force_scale = self.rigidity? / self.rest_length.powi(2);
        let stiff = |u: f64| 0.5 * self.stiffness * (u * self.rest_length).powi(2);
        let work = |u: f64| {
            -force_scale * u * self.rest_length * polynomial(u, mean(BUCKLING_COEFFICIENTS))
        };
        let energy_offset = stiff(range.onset) - work(range.onset);
        let never = Buckling::never();
        let is_stiff_again = range.end < 1.0;
        let stiff_compression = 0.5 * (range.onset + range.end);
        let stiff_energy = work(range.end) + energy_offset - stiff(range.end);
        Some(Buckling {
            force_scale,
            inverse_rest_length: self.rest_length.recip(),
            energy_offset,
            stiff_compression: if is_stiff_again {
                stiff_compression
            } else {
                never.stiff_compression
            },
            stiff_energy: if is_stiff_again { stiff_energy } else { never.stiff_energy },
        })
    }

    /// The relative compression 1 - l/L at which it buckles, or `None` if it never does.
    #[must_use]
    pub fn buckling_onset(&self) -> Option<f64> {
        self.buckled_range().map(|range| range.onset)
    }

    /// The largest derivative of its tension by its length \[N/m\]: its stiffness, or the steepest
    /// part of its buckled branch.
    #[must_use]
    pub fn stiffness_max(&self) -> f64 {
        let (Some(range), Some(buckling)) = (self.buckled_range(), self.buckling()) else {
            return self.stiffness;
        };
        // The slope of g falls a little before it rises: the steepest part is at one of the ends.
        let slope = |u: f64| {
            -buckling.force_scale
                * buckling.inverse_rest_length
                * polynomial(u, derivative(BUCKLING_COEFFICIENTS))
        };
        self.stiffness.max(slope(range.onset)).max(slope(range.end))
    }
}

/// The end of the part of an interval on which `is_true` holds, by bisection; it does at its start.
fn last_true(is_true: impl Fn(f64) -> bool, [mut low, mut high]: [f64; 2]) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return low;
        }
        if is_true(middle) { low = middle } else { high = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SpringClass;

    /// A spring with rho = B / (k L^3).
    fn kind(rho: f64) -> SpringKind {
        let [rest_length, stiffness] = [0.3, 20.0];
        let rigidity = Some(rho * stiffness * rest_length * rest_length * rest_length);
        SpringKind { class: SpringClass::Bend, rest_length, stiffness, damping: 0.0, rigidity }
    }

    /// Lengths \[m\] from zero to twice the rest length.
    fn lengths() -> impl Iterator<Item = f64> {
        (0..=4000).map(|i| f64::from(i) / 4000.0 * 0.6)
    }

    /// Among them one so small that the ramp hardly shows, some that leave the buckled branch before
    /// u = 1, and some that are nearly too rigid.
    const RATIOS: [f64; 8] = [1e-12, 1e-3, 0.01, 0.025, 0.0256, 0.028, 0.031, 0.0318];

    #[test]
    fn the_slope_and_the_polynomial_have_the_shape_that_the_range_relies_on() {
        let slope = |u| polynomial(u, derivative(BUCKLING_COEFFICIENTS));
        let slopes: Vec<f64> = (0..=10_000).map(|i| slope(f64::from(i) * 1e-4)).collect();
        assert!(slopes.iter().all(|&slope| slope < -7.5), "the force grows with the compression");
        // A rigidity for which psi can turn is one for which -g' passes 1/rho > 31.
        let steep = slopes.iter().position(|&slope| slope < -31.0).unwrap();
        assert!(slopes[..steep].iter().all(|&slope| slope >= -31.0));
        assert!(slopes[steep..].is_sorted_by(|a, b| a > b));
    }

    #[test]
    fn beyond_the_limit_a_spring_never_buckles() {
        for rho in RATIOS {
            assert!(kind(rho).buckling().is_some(), "{rho}");
        }
        for rho in [0.0319, 0.04, 0.2, 1e300, f64::INFINITY, f64::NAN] {
            assert_eq!(kind(rho).buckling(), None, "{rho}");
            assert_eq!(kind(rho).stiffness_max(), 20.0);
            // Where the branches are compared without asking that first, nothing is different.
            let scale = rho * 20.0 * 0.3;
            let buckling = Buckling {
                force_scale: scale,
                inverse_rest_length: 1.0 / 0.3,
                ..Buckling::never()
            };
            for stretch in lengths().map(|length| length - 0.3) {
                assert_eq!(buckling.tension(20.0, stretch), 20.0 * stretch, "{rho}, {stretch}");
            }
        }
        let onset = kind(1e-3).buckling_onset().unwrap();
        assert!((onset / (12.0 * 1e-3) - 1.0).abs() < 0.02, "{onset}");
    }

    #[test]
    fn it_is_not_there_where_it_never_buckles() {
        let never = Buckling::<f32>::never();
        for stretch in [-1e30, -1.0, -0.0, 0.0, 1.0, 1e30] {
            assert_eq!(never.tension(2.0, stretch), 2.0 * stretch);
            assert_eq!(never.tension_derivative(2.0, stretch), 2.0);
            assert_eq!(never.energy(2.0, stretch), stretch * stretch);
        }
        assert!(never.tension(2.0, f32::NAN).is_nan());
        assert!(kind(1e-3).buckling().unwrap().tension(20.0, f64::NAN).is_nan());
    }

    #[test]
    fn the_derivative_and_the_energy_belong_to_the_tension() {
        const STEP: f64 = 1e-6;
        for rho in RATIOS {
            let kind = kind(rho);
            let buckling = kind.buckling().unwrap();
            let stretch = |length: f64| length - kind.rest_length;
            let tension = |length| buckling.tension(kind.stiffness, stretch(length));
            let energy = |length| buckling.energy(kind.stiffness, stretch(length));
            let slope = |length| buckling.tension_derivative(kind.stiffness, stretch(length));
            let mut steepest = 0.0_f64;
            for length in lengths().filter(|&length| length > STEP) {
                let [low, high] = [length - STEP, length + STEP];
                let difference = (tension(high) - tension(low)) / (2.0 * STEP);
                // At a corner of the tension the difference is between the slopes of both sides.
                let [a, b] = [slope(low), slope(high)];
                let margin = 1e-4 * kind.stiffness;
                let within = (a.min(b) - margin..=a.max(b) + margin).contains(&difference);
                assert!(within, "{rho}, {length}: {difference} of {a} to {b}");
                assert!(slope(length) > 0.0 && slope(length) <= kind.stiffness_max() * 1.000_001);
                steepest = steepest.max(slope(length));
                // Simpson's rule.
                let work = (tension(low) + 4.0 * tension(length) + tension(high)) * STEP / 3.0;
                let error = (energy(high) - energy(low) - work).abs();
                // Rounding, and the rule's error in a cell with a corner.
                let corner = if a == b { 0.0 } else { STEP * STEP * (a - b).abs() };
                assert!(error <= 1e-15 * kind.stiffness + corner, "{rho}, {length}: {error:e}");
            }
            assert!(steepest > 0.99 * kind.stiffness_max(), "{rho}: the bound is attained");
        }
    }

    #[test]
    fn the_energy_is_the_work_on_the_way_from_the_rest_length() {
        const CELLS: u32 = 3000;
        for rho in RATIOS {
            let kind = kind(rho);
            let buckling = kind.buckling().unwrap();
            let [step, mut work] = [kind.rest_length / f64::from(CELLS), 0.0];
            for cell in 0..CELLS {
                let start = -f64::from(cell) * step;
                let tension = |share: f64| buckling.tension(kind.stiffness, start - share * step);
                work -= step / 6.0 * (tension(0.0) + 4.0 * tension(0.5) + tension(1.0));
                // Two corners at most, each wrong by less than k step^2.
                let error = (buckling.energy(kind.stiffness, start - step) - work).abs();
                let bound = 2.0 * kind.stiffness * step * step;
                assert!(error <= bound, "{rho}, {start}: {error:e} of {bound:e}");
            }
        }
    }
}
