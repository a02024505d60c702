//! What a ghost goes along with.

use super::super::{Split, closest_axis, cross, dot, plus, sub};
use crate::Real;

/// A face this far away on the other side holds a ghost as well \[m\].
const RANGE: f64 = 0.01;

/// Cosine of the angle between the directions to two faces from which on they are on two sides.
const OTHER_SIDE: f64 = -0.2;

/// A ghost is at least this far from the face \[m\]: twice of what it must be to be let go.
const HEIGHT_MIN: f64 = 2e-4;

/// A place beside a triangle of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GhostAnchor {
    /// Its corners, numbered from the first node of all bodies.
    pub nodes: [u32; 3],
    /// Barycentric coordinates of the place below, which may be beside the triangle.
    pub weights: [f64; 3],
    /// Height above it, along its normal \[m\].
    pub height: f64,
}

impl GhostAnchor {
    /// The place where nodes are there \[m\].
    #[must_use]
    pub fn place(&self, nodes: &[[f64; 3]]) -> [f64; 3] {
        let corners = self.nodes.map(|node| nodes[node as usize]);
        let height = self.height.abs().max(HEIGHT_MIN).copysign(self.height);
        let below = std::array::from_fn(|axis| {
            (0..3).map(|k| self.weights[k] * corners[k][axis]).sum::<f64>()
        });
        plus(below, height, normal(corners))
    }

    /// That of a place \[m\] beside a triangle with these corners \[m\].
    fn new(nodes: [u32; 3], corners: [[f64; 3]; 3], place: [f64; 3]) -> Self {
        let n = normal(corners);
        let height = dot(n, sub(place, corners[0]));
        let below = plus(place, -height, n);
        let area = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| dot(cross(sub(b, a), sub(c, a)), n);
        let [a, b, c] = corners;
        let whole = area(a, b, c);
        // A triangle without area is one of its corners.
        let weights = if whole > 0.0 {
            let [second, third] = [area(a, below, c) / whole, area(a, b, below) / whole];
            [1.0 - second - third, second, third]
        } else {
            [1.0, 0.0, 0.0]
        };
        Self { nodes, weights, height }
    }
}

/// The unit normal of a triangle; 0 of one without area.
fn normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let normal = cross(sub(b, a), sub(c, a));
    let length = dot(normal, normal).sqrt();
    if length > 0.0 { normal.map(|x| x / length) } else { [0.0; 3] }
}

/// Where a place \[m\] is between the bodies with these faces: the nearest one, and the nearest one on the other side.
pub(in crate::contact) fn anchors<T: Real>(
    place: [T; 3],
    faces: impl Iterator<Item = [u32; 3]>,
    node: impl Fn(u32) -> [T; 3],
) -> Vec<GhostAnchor> {
    let corners = |face: [u32; 3]| face.map(|i| node(i).map(T::to_f64));
    let place = place.map(T::to_f64);
    let closest = |face: [u32; 3]| {
        let [a, b, c] = corners(face);
        let points = [place, a, b, c];
        (gap(&points, Split::VertexTriangle), closest_axis(&points, Split::VertexTriangle))
    };
    let all: Vec<_> = faces.map(|face| (face, closest(face))).collect();
    let nearest = |is_asked: &dyn Fn([f64; 3], f64) -> bool| {
        let asked = all.iter().filter(|(_, (gap, axis))| is_asked(*axis, *gap));
        asked.min_by(|a, b| a.1.0.total_cmp(&b.1.0))
    };
    let Some(&(first, (_, side))) = nearest(&|_, _| true) else { return Vec::new() };
    let second = nearest(&|axis, gap| gap < RANGE && dot(axis, side) < OTHER_SIDE);
    let faces = [Some(first), second.map(|(face, _)| *face)];
    faces.into_iter().flatten().map(|face| GhostAnchor::new(face, corners(face), place)).collect()
}

/// Distance of two features \[m\]; 0 or less if they may meet.
pub(super) fn gap(points: &[[f64; 3]; 4], split: Split) -> f64 {
    let axis = closest_axis(points, split);
    let along = |i: usize, j: usize| dot(axis, sub(points[i], points[j]));
    let pairs: &[[usize; 2]] = match split {
        Split::VertexTriangle => &[[0, 1], [0, 2], [0, 3]],
        Split::EdgeEdge => &[[0, 2], [0, 3], [1, 2], [1, 3]],
    };
    pairs.iter().fold(f64::INFINITY, |least, &[i, j]| least.min(along(i, j)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACES: [[u32; 3]; 2] = [[0, 1, 2], [5, 4, 3]];

    /// Two triangles above each other, `gap` apart.
    fn nodes(gap: f64) -> Vec<[f64; 3]> {
        let triangle = |z: f64| [[0.0, 0.0, z], [0.03, 0.0, z], [0.0, 0.03, z]];
        triangle(0.0).into_iter().chain(triangle(gap)).collect()
    }

    fn place_in(gap: f64, anchors: &[GhostAnchor]) -> f64 {
        let nodes = nodes(gap);
        anchors.iter().map(|anchor| anchor.place(&nodes)[2]).sum::<f64>() / anchors.len() as f64
    }

    #[test]
    fn a_ghost_stays_in_the_middle_of_what_pinches_it() {
        let (place, at) = ([0.004, 0.005, 3e-4], nodes(1e-3));
        let found = anchors(place, FACES.into_iter(), |i| at[i as usize]);
        assert_eq!(found.len(), 2);
        for anchor in &found {
            let again = anchor.place(&at);
            assert!((0..3).all(|k| (again[k] - place[k]).abs() < 1e-15), "{again:?}");
        }
        // Where they go through each other by 2 mm it is as far inside of both, but for what it was nearer to one.
        assert!((place_in(-2e-3, &found) - (-1e-3 - 2e-4)).abs() < 1e-12);
        assert!((place_in(1e-3, &found) - 3e-4).abs() < 1e-12);
    }

    #[test]
    fn a_face_alone_takes_a_ghost_along_and_keeps_it_off() {
        let at = nodes(0.5);
        let found = anchors([0.004, 0.005, -2e-5], FACES.into_iter(), |i| at[i as usize]);
        assert_eq!((found.len(), found[0].nodes), (1, FACES[0]));
        assert_eq!(found[0].place(&at)[2], -HEIGHT_MIN, "on the side where it was");
    }
}
