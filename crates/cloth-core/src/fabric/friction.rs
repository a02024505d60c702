//! Friction between the threads of a fabric.

use crate::Real;

/// Friction inside a fabric, which makes the loops between loading and unloading in its measured curves. Zero for none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InternalFriction {
    /// Largest stress of friction in shear, HG: half the width of the loop at small angles, 2HG \[N/m\].
    pub shear: f64,
    /// Largest moment per width of friction in bending, HB: half the width of the loop, 2HB \[N\].
    pub bending: f64,
}

impl InternalFriction {
    /// Friction after a change of strain (NUMERICS §13): Dahl's model, one step of backward Euler.
    ///
    /// `friction` is the force before, `change` that of the strain, `slope` how steep the force rises from rest and `largest` the
    /// force at which it slips. The result never exceeds `largest` if `friction` does not.
    #[inline(always)]
    #[must_use]
    pub fn advance<T: Real>(friction: T, change: T, slope: T, largest: T) -> T {
        let rise = slope * change;
        let force = largest * (friction + rise) / (largest + rise.abs());
        if largest > T::ZERO { force } else { T::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_makes_a_loop_as_wide_as_measured() {
        let [slope, largest] = [50.0, 2.0];
        let mut force = 0.0_f64;
        let mut path = |from: f64, to: f64, steps: i32| {
            for _ in 0..steps {
                let change = (to - from) / f64::from(steps);
                force = InternalFriction::advance(force, change, slope, largest);
                assert!(force.abs() <= largest);
            }
            force
        };
        let up = path(0.0, 0.5, 1000);
        let down = path(0.5, 0.0, 1000);
        assert!((up - largest).abs() < 1e-3 && (down + largest).abs() < 1e-3, "{up} {down}");
        // From rest: F = largest (1 - exp(-slope x / largest)).
        force = 0.0;
        for _ in 0..10_000 {
            force = InternalFriction::advance(force, 0.04 / 1e4, slope, largest);
        }
        assert!((force - largest * (1.0 - (-1.0_f64).exp())).abs() < 1e-3);
        assert_eq!(InternalFriction::advance(0.0, 1.0, slope, 0.0), 0.0);
    }
}
