//! Axis-aligned boxes.

use cloth_core::Real;

use crate::memory::{LANES, Lanes};

/// An axis-aligned box; empty if `low > high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds<T> {
    pub(super) low: [T; 3],
    pub(super) high: [T; 3],
}

impl<T: Real> Bounds<T> {
    /// A box that holds nothing.
    pub(super) fn empty() -> Self {
        Self { low: [T::MAX; 3], high: [-T::MAX; 3] }
    }

    /// Grows to hold another box.
    #[inline(always)]
    pub(super) fn merge(&mut self, other: &Self) {
        for axis in 0..3 {
            self.low[axis] = other.low[axis].minimum(self.low[axis]);
            self.high[axis] = other.high[axis].maximum(self.high[axis]);
        }
    }

    /// Square of the distance of two boxes; 0 if they overlap. Rounding is monotonic, so that this
    /// is never larger than the square of the distance of two points, one in each box, computed in
    /// the same way.
    #[inline(always)]
    pub(super) fn gap_squared(&self, other: &Self) -> T {
        let mut gap = [T::ZERO; 3];
        for axis in 0..3 {
            gap[axis] = (self.low[axis] - other.high[axis])
                .maximum(other.low[axis] - self.high[axis])
                .maximum(T::ZERO);
        }
        gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2]
    }

    /// Largest absolute value of a coordinate.
    pub(super) fn magnitude(&self) -> T {
        (0..3).fold(T::ZERO, |largest, axis| {
            largest.maximum(self.low[axis].abs()).maximum(self.high[axis].abs())
        })
    }

    /// Half the longest side.
    pub(super) fn half_extent(&self) -> T {
        let half = T::from_f64(0.5);
        (0..3).fold(T::ZERO, |largest, axis| {
            largest.maximum((self.high[axis] - self.low[axis]) * half)
        })
    }

    pub(super) fn centre(&self) -> [T; 3] {
        let half = T::from_f64(0.5);
        std::array::from_fn(|axis| (self.low[axis] + self.high[axis]) * half)
    }
}

/// A box for each lane, to be grown by whole groups and reduced to one box at the end.
#[derive(Clone, Copy)]
pub(super) struct BoundsByLane<T> {
    low: [Lanes<T>; 3],
    high: [Lanes<T>; 3],
}

impl<T: Real> BoundsByLane<T> {
    #[inline(always)]
    pub(super) fn empty() -> Self {
        Self { low: [[T::MAX; LANES]; 3], high: [[-T::MAX; LANES]; 3] }
    }

    /// Grows each box to hold the point of its lane; a NaN coordinate changes nothing.
    #[inline(always)]
    pub(super) fn insert(&mut self, points: [&Lanes<T>; 3]) {
        for axis in 0..3 {
            for lane in 0..LANES {
                let value = points[axis][lane];
                self.low[axis][lane] = value.minimum(self.low[axis][lane]);
                self.high[axis][lane] = value.maximum(self.high[axis][lane]);
            }
        }
    }

    /// The same for the vectors from `origins` to `points`.
    #[inline(always)]
    pub(super) fn insert_difference(&mut self, points: [&Lanes<T>; 3], origins: [&Lanes<T>; 3]) {
        for axis in 0..3 {
            for lane in 0..LANES {
                let value = points[axis][lane] - origins[axis][lane];
                self.low[axis][lane] = value.minimum(self.low[axis][lane]);
                self.high[axis][lane] = value.maximum(self.high[axis][lane]);
            }
        }
    }

    /// The box around all lanes.
    #[inline(always)]
    pub(super) fn reduce(mut self) -> Bounds<T> {
        // A tree: the compiler may not reorder comparisons of floating point numbers by itself.
        let mut width = LANES / 2;
        while width > 0 {
            for axis in 0..3 {
                for lane in 0..width {
                    self.low[axis][lane] =
                        self.low[axis][lane].minimum(self.low[axis][lane + width]);
                    self.high[axis][lane] =
                        self.high[axis][lane].maximum(self.high[axis][lane + width]);
                }
            }
            width /= 2;
        }
        let [lx, ly, lz] = &self.low;
        let [hx, hy, hz] = &self.high;
        Bounds { low: [lx[0], ly[0], lz[0]], high: [hx[0], hy[0], hz[0]] }
    }
}
