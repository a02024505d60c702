//! Whether points, edges and triangles have a point in common: closed sets, decided exactly.
//!
//! Signs come from the adaptive predicates of Shewchuk (1997), as the crate `robust` has them. They are exact as long as no product of three
//! coordinates is too small or too large for a double.

use std::cmp::Ordering;

use robust::{Coord, Coord3D, orient2d, orient3d};

/// A point \[m\].
pub(crate) type Point = [f64; 3];

/// The sign of a number.
fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// On which side of the plane of a, b and c the point d is; 0 if all are in one plane.
pub(crate) fn side(a: Point, b: Point, c: Point, d: Point) -> i8 {
    let coordinate = |[x, y, z]: Point| Coord3D { x, y, z };
    sign(orient3d(coordinate(a), coordinate(b), coordinate(c), coordinate(d)))
}

/// On which side of the line of a and b the point c is, seen along an axis.
fn side_along(axis: usize, [a, b, c]: [Point; 3]) -> i8 {
    let coordinate = |p: Point| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] };
    sign(orient2d(coordinate(a), coordinate(b), coordinate(c)))
}

/// An axis along which a, b and c are not in one line, if there is one.
fn axis_of(triangle: [Point; 3]) -> Option<usize> {
    (0..3).find(|&axis| side_along(axis, triangle) != 0)
}

/// Whether the edge and the triangle have a point in common.
pub(crate) fn edge_meets_triangle([p, q]: [Point; 2], triangle: [Point; 3]) -> bool {
    let [a, b, c] = triangle;
    let sides = [side(a, b, c, p), side(a, b, c, q)];
    if sides[0] == sides[1] && sides[0] != 0 {
        return false;
    }
    if sides == [0, 0] {
        return match axis_of(triangle) {
            Some(axis) => edge_meets_flat(axis, [p, q], triangle),
            // A triangle without area is its edges.
            None => edges(triangle).iter().any(|edge| edges_meet([p, q], *edge)),
        };
    }
    // The line through p and q has all edges of the triangle on one side.
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    around.iter().all(|side| *side >= 0) || around.iter().all(|side| *side <= 0)
}

/// The edges of a triangle.
pub(crate) const fn edges([a, b, c]: [Point; 3]) -> [[Point; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// The same where all points are in the plane of the triangle, which has an area along `axis`.
fn edge_meets_flat(axis: usize, edge: [Point; 2], triangle: [Point; 3]) -> bool {
    is_in_flat(axis, edge[0], triangle)
        || edges(triangle).iter().any(|other| edges_meet_flat(axis, edge, *other))
}

/// Whether a point of the plane of the triangle is in it.
fn is_in_flat(axis: usize, point: Point, triangle: [Point; 3]) -> bool {
    let sides = edges(triangle).map(|[a, b]| side_along(axis, [a, b, point]));
    sides.iter().all(|side| *side >= 0) || sides.iter().all(|side| *side <= 0)
}

/// Whether two edges have a point in common.
pub(crate) fn edges_meet(first: [Point; 2], second: [Point; 2]) -> bool {
    let ([a, b], [c, d]) = (first, second);
    if side(a, b, c, d) != 0 {
        return false;
    }
    let axis = [[a, b, c], [a, b, d], [c, d, a], [c, d, b]].into_iter().find_map(axis_of);
    match axis {
        Some(axis) => edges_meet_flat(axis, first, second),
        None => overlap(first, second),
    }
}

/// The same for edges in one plane, which is not seen from its edge along `axis`.
fn edges_meet_flat(axis: usize, first: [Point; 2], second: [Point; 2]) -> bool {
    let ([a, b], [c, d]) = (first, second);
    let of_second = [side_along(axis, [a, b, c]), side_along(axis, [a, b, d])];
    let of_first = [side_along(axis, [c, d, a]), side_along(axis, [c, d, b])];
    if of_second == [0, 0] && of_first == [0, 0] {
        return overlap(first, second);
    }
    of_second[0] * of_second[1] <= 0 && of_first[0] * of_first[1] <= 0
}

/// Whether two edges in one line overlap: along a line coordinates, compared one after the other, only grow or only shrink.
fn overlap(first: [Point; 2], second: [Point; 2]) -> bool {
    let [low, high] = ordered(first);
    let [other_low, other_high] = ordered(second);
    compare(low, other_high) != Ordering::Greater && compare(other_low, high) != Ordering::Greater
}

fn ordered([a, b]: [Point; 2]) -> [Point; 2] {
    if compare(a, b) == Ordering::Greater { [b, a] } else { [a, b] }
}

fn compare(a: Point, b: Point) -> Ordering {
    // Numbers are finite; both zeros are one.
    a.partial_cmp(&b).unwrap_or(Ordering::Equal)
}

/// Whether a point is in a triangle.
pub(crate) fn is_in_triangle(point: Point, triangle: [Point; 3]) -> bool {
    edge_meets_triangle([point, point], triangle)
}
