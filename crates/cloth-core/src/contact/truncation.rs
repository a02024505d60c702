//! `contact_certify` (NUMERICS §15): what is proven at once, and how far particles may go where nothing is proven.

use crate::Real;

use super::{Split, certify, closest_axis, dot, is_apart, plus, sub};

/// Least distance of features at the end of a step \[m\].
const DISTANCE_MIN: f64 = 2e-5;

/// The same in distances from 1 to the next number, times the largest coordinate.
const DISTANCE_ULPS: f64 = 64.0;

/// The distance delta \[m\] that features keep at the end of a step, for coordinates of at most `largest` \[m\].
#[must_use]
pub fn certificate_distance<T: Real>(largest: T) -> T {
    (T::from_f64(DISTANCE_ULPS) * T::EPSILON * largest).maximum(T::from_f64(DISTANCE_MIN))
}

/// Whether it is proven that two features do not meet on their way: an axis of space first, which takes only comparisons, then those
/// of [`certify`].
#[inline(always)]
#[must_use]
pub fn is_proven<T: Real>(start: &[[T; 3]; 4], end: &[[T; 3]; 4], split: Split, delta: T) -> bool {
    along_axes(start, end, split, delta) || certify(start, end, split, delta)
}

#[inline(always)]
fn along_axes<T: Real>(start: &[[T; 3]; 4], end: &[[T; 3]; 4], split: Split, delta: T) -> bool {
    let first = match split {
        Split::VertexTriangle => 1,
        Split::EdgeEdge => 2,
    };
    let range = |points: &[[T; 3]], axis: usize| {
        let (mut low, mut high) = (points[0][axis], points[0][axis]);
        for point in &points[1..] {
            low = low.minimum(point[axis]);
            high = high.maximum(point[axis]);
        }
        [low, high]
    };
    (0..3).any(|axis| {
        let [a0, b0] = [range(&start[..first], axis), range(&start[first..], axis)];
        let [a1, b1] = [range(&end[..first], axis), range(&end[first..], axis)];
        (a0[0] > b0[1] && a1[0] - b1[1] > delta) || (b0[0] > a0[1] && b1[0] - a1[1] > delta)
    })
}

/// A plane at rest that is to stay between the features of a pair: normal to the closest vector at the start, it divides the gap as
/// the features approach it.
#[derive(Clone, Copy, Debug)]
pub struct SeparatingPlane<T> {
    /// To the first feature, of length 1.
    normal: [T; 3],
    /// A point that heights are measured from.
    origin: [T; 3],
    height: T,
    /// Distance that particles keep from it \[m\]: a little more than half of what features keep.
    floor: T,
    /// Particles of the first feature.
    first: usize,
}

impl<T: Real> SeparatingPlane<T> {
    /// That of a pair which is to keep `delta` \[m\] apart; none if nothing proves that it is apart at the start.
    #[inline(always)]
    #[must_use]
    pub fn new(start: &[[T; 3]; 4], end: &[[T; 3]; 4], split: Split, delta: T) -> Option<Self> {
        let normal = closest_axis(start, split);
        if !is_apart(start, normal, split, T::ZERO) {
            return None;
        }
        let first = match split {
            Split::VertexTriangle => 1,
            Split::EdgeEdge => 2,
        };
        let origin = start[3];
        let (mut low, mut high) = (T::INFINITY, -T::INFINITY);
        let (mut down, mut up) = (T::ZERO, T::ZERO);
        for i in 0..4 {
            let height = dot(normal, sub(start[i], origin));
            let rise = dot(normal, sub(end[i], start[i]));
            if i < first {
                low = low.minimum(height);
                down = down.maximum(-rise);
            } else {
                high = high.maximum(height);
                up = up.maximum(rise);
            }
        }
        let both = down + up;
        let share = if both > T::ZERO { up / both } else { T::from_f64(0.5) };
        // A side that cannot give way, as that of a body, must have its floor: no slide of the other makes up for it.
        let (gap, floor) = (low - high, T::from_f64(0.55) * delta);
        let (room, half) = (T::from_f64(0.6) * delta, T::from_f64(0.5));
        let least = (room / gap).maximum(T::from_f64(0.05)).minimum(half);
        let share = share.maximum(least).minimum(T::ONE - least);
        let height = high + share * gap;
        Some(Self { normal, origin, height, floor, first })
    }

    /// How far particle `i` of the pair is on its side of the plane at a place, less the floor \[m\].
    #[inline(always)]
    fn room(&self, i: usize, place: [T; 3]) -> T {
        let height = dot(self.normal, sub(place, self.origin)) - self.height;
        (if i < self.first { height } else { -height }) - self.floor
    }

    /// The place nearest to `place` that is on the side of particle `i`, if that is another one.
    #[inline(always)]
    #[must_use]
    pub fn projected(&self, i: usize, place: [T; 3]) -> Option<[T; 3]> {
        let room = self.room(i, place);
        let way = if i < self.first { -room } else { room };
        (room < T::ZERO).then(|| plus(place, way, self.normal))
    }

    /// Which share of its way particle `i` may go to stay on its side.
    #[inline(always)]
    #[must_use]
    pub fn share(&self, i: usize, start: [T; 3], end: [T; 3]) -> T {
        let rise = dot(self.normal, sub(end, start));
        let approach = if i < self.first { -rise } else { rise };
        let room = self.room(i, start);
        if approach > T::ZERO { (room.maximum(T::ZERO) / approach).minimum(T::ONE) } else { T::ONE }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle that comes at a point at rest, the tip of a body, .16 mm before it: the tip was given less room than it needs, and no slide
    /// of the triangle was a proof.
    #[test]
    fn a_slide_off_what_does_not_give_way_is_proven() {
        let delta = 2e-5;
        for gap in [3e-5, 1.6e-4, 1e-3] {
            let corners = |z: f64| [[0.01, 0.0, z], [-0.01, 0.01, z], [-0.01, -0.01, z]];
            let ([a, b, c], [d, e, f]) = (corners(-gap), corners(3e-3));
            let (start, end) = ([[0.0; 3], a, b, c], [[0.0; 3], d, e, f]);
            let split = Split::VertexTriangle;
            assert!(!is_proven(&start, &end, split, delta));
            let plane = SeparatingPlane::new(&start, &end, split, delta).unwrap();
            assert!(plane.projected(0, end[0]).is_none(), "the tip has its room: {gap}");
            let mut slid = end;
            (1..4).for_each(|i| slid[i] = plane.projected(i, end[i]).unwrap());
            assert!(is_proven(&start, &slid, split, delta), "{gap}");
        }
    }
}
