//! `contact_certify` (NUMERICS §15): what is proven at once, and how far particles may go where nothing is proven.

use crate::Real;

use super::{Split, certify, closest_axis, dot, is_apart, sub};

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

/// Which share of their way four particles may go so that a plane at rest stays between them: the plane is normal to the closest
/// vector at the start, divides the gap as the features approach it, and is approached to no less than a little more than half of
/// `delta` \[m\]. All stay where no plane is found.
#[inline(always)]
#[must_use]
pub fn truncation<T: Real>(
    start: &[[T; 3]; 4],
    end: &[[T; 3]; 4],
    split: Split,
    delta: T,
) -> [T; 4] {
    let normal = closest_axis(start, split);
    if !is_apart(start, normal, split, T::ZERO) {
        return [T::ZERO; 4];
    }
    let first = match split {
        Split::VertexTriangle => 1,
        Split::EdgeEdge => 2,
    };
    let height: [T; 4] = std::array::from_fn(|i| dot(normal, sub(start[i], start[3])));
    let rise: [T; 4] = std::array::from_fn(|i| dot(normal, sub(end[i], start[i])));
    let (mut low, mut high) = (T::INFINITY, -T::INFINITY);
    let (mut down, mut up) = (T::ZERO, T::ZERO);
    for i in 0..4 {
        if i < first {
            low = low.minimum(height[i]);
            down = down.maximum(-rise[i]);
        } else {
            high = high.maximum(height[i]);
            up = up.maximum(rise[i]);
        }
    }
    let both = down + up;
    let share = if both > T::ZERO { up / both } else { T::from_f64(0.5) };
    let share = share.maximum(T::from_f64(0.05)).minimum(T::from_f64(0.95));
    let plane = high + share * (low - high);
    let floor = T::from_f64(0.55) * delta;
    std::array::from_fn(|i| {
        let (room, approach) = if i < first {
            ((height[i] - plane) - floor, -rise[i])
        } else {
            ((plane - height[i]) - floor, rise[i])
        };
        if approach > T::ZERO { (room.maximum(T::ZERO) / approach).minimum(T::ONE) } else { T::ONE }
    })
}
