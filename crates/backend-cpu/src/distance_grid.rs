//! NUMERICS §7: solids as signed distances on a grid.

use std::sync::Arc;

use cloth_core::{DistanceGrid, GridSets, Real};

use crate::vector::{dot, sub};

/// A solid at one time, in the precision of the solver.
#[derive(Clone, Debug)]
pub(crate) struct GridSolid<T> {
    grid: Arc<DistanceGrid>,
    /// Local to world, row by row.
    pub(crate) rotation: [[T; 3]; 3],
    origin: [T; 3],
    spacing: T,
    inverse_spacing: T,
    /// Largest place along each axis, in units of the grid.
    last: [T; 3],
    /// First samples of the sets that hold, the share of the second one, sets per second.
    first: [usize; 2],
    share: T,
    rate: T,
}

impl<T: Real> GridSolid<T> {
    pub(crate) fn new(grid: &Arc<DistanceGrid>, rotation: [[T; 3]; 3], sets: GridSets) -> Self {
        let first = |set: u32| set as usize * grid.samples();
        Self {
            first: [first(sets.index), first(sets.next)],
            share: T::from_f64(sets.share),
            rate: T::from_f64(grid.rate),
            rotation,
            origin: grid.origin.map(T::from_f64),
            spacing: T::from_f64(grid.spacing),
            inverse_spacing: T::from_f64(grid.spacing.recip()),
            last: grid.size.map(|side| T::from_f64(f64::from(side - 1))),
            grid: Arc::clone(grid),
        }
    }

    /// Distance, its gradient, and how fast the surface moves outwards, at a point of the local frame.
    #[inline(always)]
    pub(crate) fn sample(&self, point: [T; 3]) -> (T, [T; 3], T) {
        let arm = sub(point, self.origin);
        let mut cell = [0_usize; 3];
        let mut share = [T::ZERO; 3];
        let mut beyond = [T::ZERO; 3];
        for axis in 0..3 {
            let place = arm[axis] * self.inverse_spacing;
            // In this order, so that NaN becomes a place of the grid.
            let clamped = place.maximum(T::ZERO).minimum(self.last[axis]);
            beyond[axis] = self.spacing * (place - clamped);
            let lower = clamped.floor_to_i32().min(self.grid.size[axis] as i32 - 2);
            cell[axis] = lower as usize;
            share[axis] = clamped - T::from_f64(f64::from(lower));
        }
        let [width, height, _] = self.grid.size.map(|side| side as usize);
        let cell = (cell[2] * height + cell[1]) * width + cell[0];
        let beyond = dot(beyond, beyond).sqrt();
        let (distance, gradient) = self.interpolate(self.first[0] + cell, share);
        if self.first[0] == self.first[1] {
            return (distance + beyond, gradient, T::ZERO);
        }
        let (next, next_gradient) = self.interpolate(self.first[1] + cell, share);
        let change = next - distance;
        let mut between = [T::ZERO; 3];
        for axis in 0..3 {
            between[axis] = gradient[axis] + self.share * (next_gradient[axis] - gradient[axis]);
        }
        (distance + self.share * change + beyond, between, -(self.rate * change))
    }

    /// Trilinear interpolation in the cell whose first sample is `first`.
    #[inline(always)]
    fn interpolate(&self, first: usize, share: [T; 3]) -> (T, [T; 3]) {
        let [width, height, _] = self.grid.size.map(|side| side as usize);
        let sample = |offset: usize| T::from_f64(f64::from(self.grid.distances[first + offset]));
        let layer = width * height;
        // Edges along x, each with its slope.
        let edge = |offset: usize| {
            let low = sample(offset);
            let slope = sample(offset + 1) - low;
            (low + share[0] * slope, slope)
        };
        let face = |offset: usize| {
            let (low, low_slope) = edge(offset);
            let (high, high_slope) = edge(offset + width);
            let across = high - low;
            (low + share[1] * across, [low_slope + share[1] * (high_slope - low_slope), across])
        };
        let (low, low_slopes) = face(0);
        let (high, high_slopes) = face(layer);
        let mut gradient = [T::ZERO, T::ZERO, high - low];
        for axis in 0..2 {
            gradient[axis] = low_slopes[axis] + share[2] * (high_slopes[axis] - low_slopes[axis]);
        }
        let distance = low + share[2] * (high - low);
        (distance, gradient)
    }
}
