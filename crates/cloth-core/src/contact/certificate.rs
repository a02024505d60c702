//! A proof, in the arithmetic of a solver, that two features in linear motion do not meet within a step (NUMERICS §14).
//!
//! For a fixed axis n the gap G(t) = min over the cross pairs of n . (a_i(t) - b_j(t)) is a minimum of linear functions, hence
//! concave: positive at both ends of a step it is positive throughout. Any axis will do, so how it is found needs no care; only
//! the comparison has a margin, for which NUMERICS derives that no rounding error can make it hold for features that meet.

use super::{cross, dot, sub};
use crate::Real;

/// How four points are two features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// Point 0 against the triangle of points 1, 2 and 3.
    VertexTriangle,
    /// The edge of points 0 and 1 against that of points 2 and 3.
    EdgeEdge,
}

impl Split {
    /// How many of the points are of the first feature.
    pub(super) const fn first(self) -> usize {
        match self {
            Self::VertexTriangle => 1,
            Self::EdgeEdge => 2,
        }
    }

    /// The cross pairs \[i, j\]: point i is of the first feature, j of the second.
    #[inline(always)]
    const fn pairs(self) -> &'static [[usize; 2]] {
        match self {
            Self::VertexTriangle => &[[0, 1], [0, 2], [0, 3]],
            Self::EdgeEdge => &[[0, 2], [0, 3], [1, 2], [1, 3]],
        }
    }
}

/// The margin of the comparison, in units of roundoff times sum |n_k| |d_k|. Rounding takes 4 of them (NUMERICS §14).
pub const MARGIN: u8 = 8;

/// Whether two features, which go in straight lines from `start` to `end` \[m\], are proven to be apart at all times between.
///
/// `true` is a proof, degenerate features included. `false` says that none of the axes that are tried proves it: the
/// features may meet, or not. At the end the features must also be `delta` \[m\] apart, so that the next step can be
/// certified from its start. Numbers that are not finite certify nothing.
#[inline(always)]
#[must_use]
pub fn certify<T: Real>(start: &[[T; 3]; 4], end: &[[T; 3]; 4], split: Split, delta: T) -> bool {
    certify_with_margin(start, end, split, delta, MARGIN)
}

/// [`certify`] with another margin than [`MARGIN`], which alone is proven: tests show what goes wrong with less.
#[inline(always)]
#[must_use]
pub fn certify_with_margin<T: Real>(
    start: &[[T; 3]; 4],
    end: &[[T; 3]; 4],
    split: Split,
    delta: T,
    margin: u8,
) -> bool {
    let proves = |axis: [T; 3]| {
        is_apart_with_margin(start, axis, split, T::ZERO, margin)
            & is_apart_with_margin(end, axis, split, delta, margin)
    };
    // The closest vectors first, which are enough for most pairs.
    let at_start = directions(start, split);
    if proves(unit(at_start[0])) {
        return true;
    }
    let at_end = directions(end, split);
    proves(unit(at_end[0])) || proves(unit(at_start[1])) || proves(unit(at_end[1]))
}

/// Whether the first axis that [`certify`] tries is a proof, as it is for most pairs: without a branch, so that loops over pairs become
/// vector code.
#[inline(always)]
#[must_use]
pub fn certify_at_start<T: Real>(
    start: &[[T; 3]; 4],
    end: &[[T; 3]; 4],
    split: Split,
    delta: T,
) -> bool {
    let axis = closest_axis(start, split);
    is_apart(start, axis, split, T::ZERO) & is_apart(end, axis, split, delta)
}

/// Whether `axis` proves the features to be apart at `points`: n . (a_i - b_j) exceeds `delta` \[m\] and what rounding can do for
/// all cross pairs. No component of the axis may exceed 2; `delta` is a length if the axis has length 1.
#[inline(always)]
#[must_use]
pub fn is_apart<T: Real>(points: &[[T; 3]; 4], axis: [T; 3], split: Split, delta: T) -> bool {
    is_apart_with_margin(points, axis, split, delta, MARGIN)
}

#[inline(always)]
fn is_apart_with_margin<T: Real>(
    points: &[[T; 3]; 4],
    axis: [T; 3],
    split: Split,
    delta: T,
    margin: u8,
) -> bool {
    // The unit of roundoff is half of the distance from 1 to the next number. Products too small for a normal number count as
    // zero on some devices, which the smallest of these covers.
    let relative = T::from_f64(0.5 * f64::from(margin)) * T::EPSILON;
    let floor = delta + T::from_f64(2.0 * f64::from(margin)) * T::MIN_POSITIVE;
    split.pairs().iter().fold(true, |apart, &[i, j]| {
        let d = sub(points[i], points[j]);
        let [x, y, z] = [axis[0] * d[0], axis[1] * d[1], axis[2] * d[2]];
        apart & (x + y + z > relative * (x.abs() + y.abs() + z.abs()) + floor)
    })
}

/// Unit vector from the closest point of the second feature to that of the first, or zero where there is none.
#[inline(always)]
#[must_use]
pub fn closest_axis<T: Real>(points: &[[T; 3]; 4], split: Split) -> [T; 3] {
    unit(directions(points, split)[0])
}

/// The direction of the closest vector, and the other one of these two: the normal of the triangle or of both edges, and the closest
/// vector to the border of the triangle, or from or to an end of an edge. All point to the first feature.
#[inline(always)]
fn directions<T: Real>(points: &[[T; 3]; 4], split: Split) -> [[T; 3]; 2] {
    let (normal, is_inside) = normal(points, split);
    let border = border(points, split);
    let choose = |first: bool| std::array::from_fn(|k| if first { normal[k] } else { border[k] });
    [choose(is_inside), choose(!is_inside)]
}

/// The normal, of any length, and whether the closest points lie inside the triangle or inside both edges. All is relative to point
/// 0: features far from the origin lose nothing.
#[inline(always)]
fn normal<T: Real>(points: &[[T; 3]; 4], split: Split) -> ([T; 3], bool) {
    let r = [1, 2, 3].map(|i| sub(points[i], points[0]));
    let (normal, is_inside) = match split {
        Split::VertexTriangle => {
            let normal = cross(sub(r[1], r[0]), sub(r[2], r[0]));
            let weight = |a, b| dot(cross(a, b), normal);
            let is_inside = (weight(r[1], r[2]) > T::ZERO)
                & (weight(r[2], r[0]) > T::ZERO)
                & (weight(r[0], r[1]) > T::ZERO);
            (normal, is_inside)
        }
        Split::EdgeEdge => {
            let v = sub(points[3], points[2]);
            let normal = cross(r[0], v);
            let square = dot(normal, normal);
            let s = dot(cross(r[1], v), normal);
            let t = dot(cross(r[1], r[0]), normal);
            let is_inside = (s > T::ZERO) & (s < square) & (t > T::ZERO) & (t < square);
            (normal, is_inside)
        }
    };
    // r_1 (triangle: r_0) is a cross pair seen from the second feature.
    let across = match split {
        Split::VertexTriangle => r[0],
        Split::EdgeEdge => r[1],
    };
    let is_behind = dot(normal, across) > T::ZERO;
    (normal.map(|x| if is_behind { -x } else { x }), is_inside)
}

/// The shortest vector to the first feature from the border of the second, or from an end of one edge to the other edge.
#[inline(always)]
fn border<T: Real>(points: &[[T; 3]; 4], split: Split) -> [T; 3] {
    let [a, b, c, d] = *points;
    match split {
        Split::VertexTriangle => {
            let r = [sub(a, b), sub(a, c), sub(a, d)];
            let edges = [segment(r[0], r[1]), segment(r[1], r[2]), segment(r[2], r[0])];
            shortest(shortest(edges[0], edges[1]), edges[2])
        }
        Split::EdgeEdge => {
            let r = [[sub(a, c), sub(a, d)], [sub(b, c), sub(b, d)]];
            let of_first = shortest(segment(r[0][0], r[0][1]), segment(r[1][0], r[1][1]));
            let of_second = shortest(segment(r[0][0], r[1][0]), segment(r[0][1], r[1][1]));
            shortest(of_first, of_second)
        }
    }
}

/// The vector from the origin to the closest point of the segment p q.
#[inline(always)]
fn segment<T: Real>(p: [T; 3], q: [T; 3]) -> [T; 3] {
    let edge = sub(q, p);
    let share = -dot(p, edge) / dot(edge, edge).maximum(T::MIN_POSITIVE);
    let share = share.maximum(T::ZERO).minimum(T::ONE);
    std::array::from_fn(|k| p[k] + share * edge[k])
}

#[inline(always)]
fn shortest<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    let is_first = dot(a, a) <= dot(b, b);
    std::array::from_fn(|k| if is_first { a[k] } else { b[k] })
}

/// The vector with length 1, to a few units of roundoff, or zero. Scaled first, so that no square is out of range.
#[inline(always)]
fn unit<T: Real>(v: [T; 3]) -> [T; 3] {
    let largest = v[0].abs().maximum(v[1].abs()).maximum(v[2].abs());
    let scale = T::ONE / largest.maximum(T::MIN_POSITIVE);
    let scaled = v.map(|x| x * scale);
    let inverse = T::ONE / dot(scaled, scaled).sqrt().maximum(T::MIN_POSITIVE);
    scaled.map(|x| x * inverse)
}
