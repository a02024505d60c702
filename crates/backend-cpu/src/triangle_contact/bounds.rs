//! Boxes with sides along the axes, at both ends of ways.

use cloth_core::{Real, contact::Split};

/// A point, or an axis of a box for each of its coordinates. The fourth is zero: four fill a vector register.
pub(super) type Padded<T> = [T; 4];

#[inline(always)]
pub(super) fn padded<T: Real>([x, y, z]: [T; 3]) -> Padded<T> {
    [x, y, z, T::ZERO]
}

/// Two points of a way, [`Padded`] and side by side.
pub(super) type Ends<T> = [T; 8];

/// The sides of [`Ends`] that are coordinates, in pairs of start and end.
pub(super) const AXES: [[usize; 2]; 3] = [[0, 4], [1, 5], [2, 6]];

#[inline(always)]
pub(super) fn ends<T: Real>([x, y, z]: [T; 3], [u, v, w]: [T; 3]) -> Ends<T> {
    [x, y, z, T::ZERO, u, v, w, T::ZERO]
}

/// A box with sides along the axes, or one for each end of some ways.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds<T, const SIDES: usize> {
    pub(super) low: [T; SIDES],
    pub(super) high: [T; SIDES],
}

impl<T: Real, const SIDES: usize> Bounds<T, SIDES> {
    /// No box: it is apart from all.
    pub(super) const EMPTY: Self = Self { low: [T::INFINITY; SIDES], high: [T::MAX; SIDES] };

    /// Around some points, or ends of ways.
    #[inline(always)]
    pub(super) fn around<const N: usize>(points: [[T; SIDES]; N]) -> Self {
        let mut bounds = Self { low: points[0], high: points[0] };
        for point in &points[1..] {
            bounds = bounds.join(&Self { low: *point, high: *point });
        }
        bounds
    }

    /// Around two boxes, none of them empty.
    #[inline(always)]
    pub(super) fn join(mut self, other: &Self) -> Self {
        for side in 0..SIDES {
            self.low[side] = self.low[side].minimum(other.low[side]);
            self.high[side] = self.high[side].maximum(other.high[side]);
        }
        self
    }

    #[inline(always)]
    pub(super) fn with(self, other: &Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => *other,
            (_, true) => self,
            _ => self.join(other),
        }
    }

    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.low[0] == T::INFINITY
    }
}

/// Boxes around both features of a pair. No array is mapped: that is a call of its own.
#[inline(always)]
pub(super) fn boxes<T: Real, const SIDES: usize>(
    split: Split,
    [a, b, c, d]: [u32; 4],
    places: &[[T; SIDES]],
) -> [Bounds<T, SIDES>; 2] {
    let [a, b] = [places[a as usize], places[b as usize]];
    let [c, d] = [places[c as usize], places[d as usize]];
    match split {
        Split::VertexTriangle => [Bounds::around([a]), Bounds::around([b, c, d])],
        Split::EdgeEdge => [Bounds::around([a, b]), Bounds::around([c, d])],
    }
}

impl<T: Real> Bounds<T, 4> {
    /// Whether along some axis it is `reach`, which is not zero, or more away from another.
    #[inline(always)]
    pub(super) fn is_apart(&self, other: &Self, reach: T) -> bool {
        let mut apart = [false; 4];
        for axis in 0..4 {
            apart[axis] = (self.low[axis] - other.high[axis] >= reach)
                | (other.low[axis] - self.high[axis] >= reach);
        }
        apart[0] | apart[1] | apart[2] | apart[3]
    }
}

impl<T: Real> Bounds<T, 8> {
    /// Whether along some axis, on the same side of it at both ends of their ways, it is `reach`, which is not zero, or more away from another: then
    /// it is so all the way, however far both go together.
    #[inline(always)]
    pub(super) fn is_apart(&self, other: &Self, reach: T) -> bool {
        let (mut above, mut below) = ([T::ZERO; 8], [T::ZERO; 8]);
        for side in 0..8 {
            above[side] = self.low[side] - other.high[side];
            below[side] = other.low[side] - self.high[side];
        }
        let mut gaps = [T::ZERO; 4];
        for axis in 0..4 {
            let above = above[axis].minimum(above[4 + axis]);
            let below = below[axis].minimum(below[4 + axis]);
            gaps[axis] = above.maximum(below);
        }
        gaps[0].maximum(gaps[1]).maximum(gaps[2].maximum(gaps[3])) >= reach
    }

    /// Whether it is proven to be apart from another all the way: along some axis it is on one side of it at the start of their ways, and on the
    /// same side by more than `delta` at their end.
    #[inline(always)]
    pub(super) fn is_proven_apart(&self, other: &Self, delta: T) -> bool {
        let zero = T::ZERO;
        let least = [zero, zero, zero, zero, delta, delta, delta, delta];
        let (mut above, mut below) = ([zero; 8], [zero; 8]);
        for side in 0..8 {
            // One number is above another if and only if their difference, once rounded, is above zero.
            above[side] = self.low[side] - other.high[side] - least[side];
            below[side] = other.low[side] - self.high[side] - least[side];
        }
        let mut beyond = [zero; 4];
        for axis in 0..4 {
            let above = above[axis].minimum(above[4 + axis]);
            let below = below[axis].minimum(below[4 + axis]);
            beyond[axis] = above.maximum(below);
        }
        beyond[0].maximum(beyond[1]).maximum(beyond[2].maximum(beyond[3])) > zero
    }
}
