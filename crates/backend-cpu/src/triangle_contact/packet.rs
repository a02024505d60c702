//! Features side by side, so that one is compared with eight others at a time.

use cloth_core::{Real, contact::ContactSurface};

use super::bounds::{AXES, Bounds, Ends};

/// Features side by side.
pub(super) const LANES: usize = 8;

/// No feature: a lane that is left over.
const NONE: u32 = u32::MAX;

/// A bit for each lane, 1 where something is so.
pub(super) type Mask = u32;

/// All lanes.
pub(super) const ALL: Mask = (1 << LANES) - 1;

/// Lanes behind this one.
#[inline(always)]
pub(super) const fn behind(lane: usize) -> Mask {
    ALL & (ALL << lane << 1)
}

/// Features with `CORNERS` corners each.
#[derive(Debug)]
pub(super) struct Packet<T, const CORNERS: usize> {
    count: usize,
    features: [u32; LANES],
    /// Numbers that corners have in common where they are one particle, or seams make them one.
    classes: [[u32; LANES]; CORNERS],
    /// A row for each coordinate at the start of ways, then for each at their end.
    low: [[T; LANES]; 6],
    high: [[T; LANES]; 6],
}

impl<T: Real, const CORNERS: usize> Packet<T, CORNERS> {
    /// Of at most as many features as there are lanes.
    pub(super) fn new(
        surface: &ContactSurface,
        numbers: &[u32],
        corners: &[[u32; CORNERS]],
    ) -> Self {
        let mut features = [NONE; LANES];
        features[..numbers.len()].copy_from_slice(numbers);
        let mut classes = [[NONE; LANES]; CORNERS];
        for (lane, &number) in numbers.iter().enumerate() {
            for (classes, corner) in classes.iter_mut().zip(corners[number as usize]) {
                classes[lane] = surface.classes()[corner as usize];
            }
        }
        let (low, high) = ([[T::INFINITY; LANES]; 6], [[-T::INFINITY; LANES]; 6]);
        Self { count: numbers.len(), features, classes, low, high }
    }

    /// The number of a feature.
    #[inline(always)]
    pub(super) fn feature(&self, lane: usize) -> u32 {
        self.features[lane]
    }

    /// The classes of the corners of a feature.
    #[inline(always)]
    pub(super) fn classes(&self, lane: usize) -> [u32; CORNERS] {
        std::array::from_fn(|corner| self.classes[corner][lane])
    }

    /// The box of a feature.
    #[inline(always)]
    pub(super) fn bounds(&self, lane: usize) -> Bounds<T, 8> {
        let mut bounds = Bounds { low: [T::ZERO; 8], high: [T::ZERO; 8] };
        for axis in 0..3 {
            let [start, end] = AXES[axis];
            bounds.low[start] = self.low[axis][lane];
            bounds.low[end] = self.low[3 + axis][lane];
            bounds.high[start] = self.high[axis][lane];
            bounds.high[end] = self.high[3 + axis][lane];
        }
        bounds
    }

    /// Puts boxes around features, whose corners are on these ways. Returns the one around all of them.
    #[inline(always)]
    pub(super) fn refit(
        &mut self,
        vertices: &[Ends<T>],
        corners: &[[u32; CORNERS]],
    ) -> Bounds<T, 8> {
        let mut all: Option<Bounds<T, 8>> = None;
        for lane in 0..self.count {
            let corners = corners[self.features[lane] as usize];
            let mut bounds = Bounds::around([vertices[corners[0] as usize]]);
            for &corner in &corners[1..] {
                bounds = bounds.join(&Bounds::around([vertices[corner as usize]]));
            }
            for axis in 0..3 {
                let [start, end] = AXES[axis];
                self.low[axis][lane] = bounds.low[start];
                self.low[3 + axis][lane] = bounds.low[end];
                self.high[axis][lane] = bounds.high[start];
                self.high[3 + axis][lane] = bounds.high[end];
            }
            all = Some(all.map_or(bounds, |all| all.join(&bounds)));
        }
        all.unwrap_or(Bounds::EMPTY)
    }

    /// The features that have a marked corner.
    pub(super) fn marks(&self, marked: &[bool], corners: &[[u32; CORNERS]]) -> Mask {
        self.features[..self.count].iter().enumerate().fold(0, |marks, (lane, &feature)| {
            let is_marked = corners[feature as usize].iter().any(|&corner| marked[corner as usize]);
            marks | Mask::from(is_marked) << lane
        })
    }

    /// How far features are from a box: along an axis, on the same side of it at both ends of their ways, or less than zero.
    #[inline(always)]
    pub(super) fn gaps(&self, bounds: &Bounds<T, 8>) -> Gaps<T> {
        let mut gaps = [-T::INFINITY; LANES];
        for axis in 0..3 {
            let [start, end] = AXES[axis];
            let [low, high] = [&self.low[axis], &self.high[axis]];
            let [low_end, high_end] = [&self.low[3 + axis], &self.high[3 + axis]];
            for lane in 0..LANES {
                let above = low[lane] - bounds.high[start];
                let above = above.minimum(low_end[lane] - bounds.high[end]);
                let below = bounds.low[start] - high[lane];
                let below = below.minimum(bounds.low[end] - high_end[lane]);
                gaps[lane] = gaps[lane].maximum(above.maximum(below));
            }
        }
        Gaps(gaps)
    }

    /// Leaves out the features that have a corner of one of these classes.
    #[inline(always)]
    pub(super) fn less<const N: usize>(&self, classes: [u32; N], mut gaps: Gaps<T>) -> Gaps<T> {
        for own in &self.classes {
            for class in classes {
                for lane in 0..LANES {
                    let is_one = own[lane] == class;
                    gaps.0[lane] = if is_one { T::INFINITY } else { gaps.0[lane] };
                }
            }
        }
        gaps
    }
}

/// A distance for each lane \[m\].
#[derive(Clone, Copy)]
pub(super) struct Gaps<T>([T; LANES]);

impl<T: Real> Gaps<T> {
    /// Where they are less than this.
    #[inline(always)]
    pub(super) fn below(&self, reach: T) -> Mask {
        // From the sign of a difference: a comparison would be taken apart, lane by lane.
        let mut mask = 0;
        for lane in 0..LANES {
            let sign = (self.0[lane] - reach).to_f64().to_bits() >> 63;
            mask |= (sign << lane) as Mask;
        }
        mask
    }
}

/// Takes the first lane out of a mask.
#[inline(always)]
pub(super) fn next(mask: &mut Mask) -> Option<usize> {
    if *mask == 0 {
        return None;
    }
    let lane = mask.trailing_zeros() as usize;
    *mask &= *mask - 1;
    Some(lane)
}
