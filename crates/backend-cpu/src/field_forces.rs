//! NUMERICS §3: gravity, uniform fields, drag.

use cloth_core::{Model, Real};

use crate::memory::{LANES, Lanes};

/// Uniform acceleration \[m/s^2\] and drag rate \[1/s\] of a model, all its fields together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FieldSum<T> {
    acceleration: [T; 3],
    drag_rate: [T; 3],
}

impl<T: Real> FieldSum<T> {
    pub(crate) fn new(model: &Model) -> Self {
        Self {
            acceleration: model.uniform_acceleration().map(T::from_f64),
            drag_rate: model.drag_rate().map(T::from_f64),
        }
    }

    /// Acceleration and drag rate.
    pub(crate) const fn sums(&self) -> ([T; 3], [T; 3]) {
        (self.acceleration, self.drag_rate)
    }
}

/// Forces of the fields on a packet.
#[inline(always)]
pub(crate) fn packet<T: Real>(
    fields: &FieldSum<T>,
    mass: &Lanes<T>,
    velocity: [&Lanes<T>; 3],
) -> [Lanes<T>; 3] {
    let mut force = [[T::ZERO; LANES]; 3];
    for axis in 0..3 {
        for lane in 0..LANES {
            force[axis][lane] = mass[lane]
                * (fields.acceleration[axis] - fields.drag_rate[axis] * velocity[axis][lane]);
        }
    }
    force
}
