//! Distances between the particles of two groups, a packet at a time.

use cloth_core::Real;

use super::{
    bounds::Bounds,
    groups::{GROUP, Groups},
};
use crate::memory::Lanes;

/// Coordinates of the particles of a group.
type Points<'a, T> = [&'a Lanes<T>; 3];

/// Square of the distance of the closest pair of particles of two groups that counts, or of `look`
/// if they are farther apart than that. Pairs closer than `distance` at rest do not count, where
/// such pairs are left out.
#[inline(always)]
pub(super) fn closest_squared<T: Real>(
    groups: &Groups<T>,
    group: usize,
    other: usize,
    [distance, look]: [T; 2],
) -> T {
    let limit = distance * distance;
    let look_squared = look * look;
    let own = groups.group(group);
    let rest = groups.group_at_rest(group);
    let mut closest = [look_squared; GROUP];
    if group == other {
        closest_within(own, rest, limit, &mut closest);
    } else {
        let others = groups.group(other);
        let rest = rest.zip(groups.group_at_rest(other));
        let mut near = below(&gaps_squared(&groups.bounds()[group], others), look_squared);
        while near != 0 {
            let j = near.trailing_zeros() as usize;
            near &= near - 1;
            let lengths = lengths_squared(own, others, rest, j, limit);
            for lane in 0..GROUP {
                closest[lane] = lengths[lane].minimum(closest[lane]);
            }
        }
    }
    let mut width = GROUP / 2;
    while width > 0 {
        for lane in 0..width {
            closest[lane] = closest[lane].minimum(closest[lane + width]);
        }
        width /= 2;
    }
    closest[0]
}

/// Lists the pairs in contact of two groups that have some.
#[inline(always)]
pub(super) fn list_pairs<T: Real>(
    groups: &Groups<T>,
    group: usize,
    other: usize,
    limit: T,
    found: &mut Vec<[u32; 2]>,
) {
    let own = groups.group(group);
    let others = groups.group(other);
    let rest = groups.group_at_rest(group).zip(groups.group_at_rest(other));
    let mut near = below(&gaps_squared(&groups.bounds()[group], others), limit);
    while near != 0 {
        let j = near.trailing_zeros() as usize;
        near &= near - 1;
        let lengths = lengths_squared(own, others, rest, j, limit);
        let mut touching = below(&lengths, limit);
        if group == other {
            // Each pair once, and no particle with itself.
            touching &= u32::MAX << (j + 1);
        }
        while touching != 0 {
            let i = touching.trailing_zeros() as usize;
            touching &= touching - 1;
            found.push([(group * GROUP + i) as u32, (other * GROUP + j) as u32]);
        }
    }
}

/// Lowers `closest` to the square of the distance of each particle of a group to the nearest of its
/// fellows that counts. Each is compared with the next eight, cyclically: every pair comes up, none needs a mask.
#[inline(always)]
fn closest_within<T: Real>(
    own: Points<'_, T>,
    rest: Option<Points<'_, T>>,
    limit: T,
    closest: &mut Lanes<T>,
) {
    let twice = doubled(own);
    let rest = rest.map(|rest| (rest, doubled(rest)));
    for shift in 1..=GROUP / 2 {
        let mut lengths = distances_squared_shifted(own, &twice, shift);
        if let Some((rest, rest_twice)) = &rest {
            let at_rest = distances_squared_shifted(*rest, rest_twice, shift);
            leave_out(&mut lengths, &at_rest, limit);
        }
        for lane in 0..GROUP {
            closest[lane] = lengths[lane].minimum(closest[lane]);
        }
    }
}

/// The lanes of a group, and again from the start.
#[inline(always)]
fn doubled<T: Real>(points: Points<'_, T>) -> [[T; 2 * GROUP]; 3] {
    let mut twice = [[T::ZERO; 2 * GROUP]; 3];
    for axis in 0..3 {
        twice[axis][..GROUP].copy_from_slice(points[axis]);
        twice[axis][GROUP..].copy_from_slice(points[axis]);
    }
    twice
}

/// Square of the distance of each of `points` to the entry of `others` that is `shift` further on.
#[inline(always)]
fn distances_squared_shifted<T: Real>(
    points: Points<'_, T>,
    others: &[[T; 2 * GROUP]; 3],
    shift: usize,
) -> Lanes<T> {
    let mut squares = [T::ZERO; GROUP];
    for lane in 0..GROUP {
        let dx = points[0][lane] - others[0][lane + shift];
        let dy = points[1][lane] - others[1][lane + shift];
        let dz = points[2][lane] - others[2][lane + shift];
        squares[lane] = dx * dx + dy * dy + dz * dz;
    }
    squares
}

/// Square of the distance of each of `own` to entry `j` of `others`, with pairs that are left out too
/// far away to count. `rest` are the rest positions of both, where they matter.
#[inline(always)]
fn lengths_squared<T: Real>(
    own: Points<'_, T>,
    others: Points<'_, T>,
    rest: Option<(Points<'_, T>, Points<'_, T>)>,
    j: usize,
    limit: T,
) -> Lanes<T> {
    let mut lengths = distances_squared(own, [others[0][j], others[1][j], others[2][j]]);
    if let Some((own, others)) = rest {
        let at_rest = distances_squared(own, [others[0][j], others[1][j], others[2][j]]);
        leave_out(&mut lengths, &at_rest, limit);
    }
    lengths
}

/// Square of the distance of each of `points` to `other`.
#[inline(always)]
fn distances_squared<T: Real>(points: Points<'_, T>, other: [T; 3]) -> Lanes<T> {
    let mut squares = [T::ZERO; GROUP];
    for lane in 0..GROUP {
        let dx = points[0][lane] - other[0];
        let dy = points[1][lane] - other[1];
        let dz = points[2][lane] - other[2];
        squares[lane] = dx * dx + dy * dy + dz * dz;
    }
    squares
}

/// Square of the distance of each of `points` to a box.
#[inline(always)]
fn gaps_squared<T: Real>(bounds: &Bounds<T>, points: Points<'_, T>) -> Lanes<T> {
    let Bounds { low, high } = *bounds;
    let [x, y, z] = points;
    let mut squares = [T::ZERO; GROUP];
    for lane in 0..GROUP {
        let dx = (low[0] - x[lane]).maximum(x[lane] - high[0]).maximum(T::ZERO);
        let dy = (low[1] - y[lane]).maximum(y[lane] - high[1]).maximum(T::ZERO);
        let dz = (low[2] - z[lane]).maximum(z[lane] - high[2]).maximum(T::ZERO);
        squares[lane] = dx * dx + dy * dy + dz * dz;
    }
    squares
}

/// Makes the pairs that are closer than the limit at rest too far away to count.
#[inline(always)]
fn leave_out<T: Real>(lengths: &mut Lanes<T>, at_rest: &Lanes<T>, limit: T) {
    for lane in 0..GROUP {
        lengths[lane] = if at_rest[lane] < limit { T::MAX } else { lengths[lane] };
    }
}

/// The lanes with a value below `limit`, as bits. Comparison with NaN is false, so a place without
/// a particle is never among them.
#[inline(always)]
fn below<T: Real>(values: &Lanes<T>, limit: T) -> u32 {
    let mut bits = [0_u32; GROUP];
    for lane in 0..GROUP {
        bits[lane] = if values[lane] < limit { 1 << lane } else { 0 };
    }
    let mut all = 0;
    for lane in 0..GROUP {
        all |= bits[lane];
    }
    all
}
