//! Whether a vertex meets a triangle, or an edge an edge, at some time of a linear motion: decided without rounding, by the roots of the
//! determinant of four points and signs at these, degenerate features included.

use cloth_core::contact::Split;
use num_bigint::BigInt;

use crate::polynomial::Polynomial;

type Vector = [Polynomial; 3];
/// The sign of a polynomial at the time that is looked at.
type SignAt<'a> = &'a mut dyn FnMut(&Polynomial) -> i8;

/// Whether the features meet at some time from 0 to 1. All numbers are finite.
pub(crate) fn meets(start: &[[f64; 3]; 4], end: &[[f64; 3]; 4], split: Split) -> bool {
    Motion::new(start, end, split).meets()
}

/// Two features, each point a linear function of time.
struct Motion {
    split: Split,
    points: [Vector; 4],
    /// Twice an area in three components, zero where all is in one line: of the triangle, or spanned by both edges.
    normal: Vector,
    /// Zero when the four points are in one plane.
    determinant: Polynomial,
    /// None of these may be negative while they are in one plane.
    weights: Vec<Polynomial>,
    /// The segments that touch the origin if an end of one feature is on an edge of the other.
    segments: Vec<[Vector; 2]>,
}

impl Motion {
    fn new(start: &[[f64; 3]; 4], end: &[[f64; 3]; 4], split: Split) -> Self {
        let [start, end] = integers([start, end]);
        let point = |i: usize| -> Vector {
            std::array::from_fn(|k| {
                Polynomial::new(vec![start[i][k].clone(), &end[i][k] - &start[i][k]])
            })
        };
        let points = [0, 1, 2, 3].map(point);
        let d = |i: usize, j: usize| minus(&points[i], &points[j]);
        let (normal, determinant, weights, segments) = match split {
            Split::VertexTriangle => {
                let r = [d(1, 0), d(2, 0), d(3, 0)];
                let normal = cross(&d(2, 1), &d(3, 1));
                let determinant = dot(&r[0], &cross(&r[1], &r[2]));
                let sides = [[0, 1], [1, 2], [2, 0]];
                let weights = sides.map(|[i, j]| dot(&cross(&r[i], &r[j]), &normal));
                let segments = sides.map(|[i, j]| [r[i].clone(), r[j].clone()]);
                (normal, determinant, weights.to_vec(), segments.to_vec())
            }
            Split::EdgeEdge => {
                let (u, v, r) = (d(1, 0), d(3, 2), d(2, 0));
                let normal = cross(&u, &v);
                let square = dot(&normal, &normal);
                let s = dot(&cross(&r, &v), &normal);
                let t = dot(&cross(&r, &u), &normal);
                let weights = vec![square.minus(&s), square.minus(&t), s, t];
                let ends = [[0, 2, 3], [1, 2, 3], [2, 0, 1], [3, 0, 1]];
                let segments = ends.map(|[end, p, q]| [d(p, end), d(q, end)]);
                let determinant = dot(&r, &normal);
                (normal, determinant, weights, segments.to_vec())
            }
        };
        Self { split, points, normal, determinant, weights, segments }
    }

    /// Whether they meet at one time.
    fn meets_at(&self, sign: SignAt<'_>) -> bool {
        if self.normal.iter().any(|component| sign(component) != 0) {
            return sign(&self.determinant) == 0
                && self.weights.iter().all(|weight| sign(weight) >= 0);
        }
        self.segments.iter().any(|segment| touches(segment, sign))
    }

    fn meets(&self) -> bool {
        debug_assert!(self.points.len() == 4, "{:?}", self.split);
        let at_end = |end: u32| {
            let time = BigInt::from(end);
            self.meets_at(&mut |polynomial| polynomial.sign_at(&time, 0))
        };
        if at_end(0) || at_end(1) {
            return true;
        }
        if !self.determinant.is_zero() {
            let mut roots = self.determinant.roots();
            return roots.iter_mut().any(|root| self.meets_at(&mut |p| root.sign(p)));
        }
        // In one plane all the time: apart at the start, they meet where an end of one feature comes to an edge of the other.
        self.segments.iter().any(|segment| {
            let [p, q] = segment;
            let area = cross(p, q);
            let decides = area.iter().find(|component| !component.is_zero());
            // In one line all the time: p . q, positive at the start, comes to zero.
            let product = dot(p, q);
            let decides = decides.unwrap_or(&product);
            !decides.is_zero()
                && decides.roots().iter_mut().any(|root| touches(segment, &mut |p| root.sign(p)))
        })
    }
}

/// Whether the origin is on the segment.
fn touches([p, q]: &[Vector; 2], sign: SignAt<'_>) -> bool {
    cross(p, q).iter().all(|component| sign(component) == 0) && sign(&dot(p, q)) <= 0
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|k| a[k].minus(&b[k]))
}

fn dot(a: &Vector, b: &Vector) -> Polynomial {
    a[0].times(&b[0]).plus(&a[1].times(&b[1])).plus(&a[2].times(&b[2]))
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [[1, 2], [2, 0], [0, 1]].map(|[i, j]| a[i].times(&b[j]).minus(&a[j].times(&b[i])))
}

/// All coordinates as multiples of one power of two, relative to the first point at the start.
fn integers(points: [&[[f64; 3]; 4]; 2]) -> [[[BigInt; 3]; 4]; 2] {
    let split = |x: f64| -> (i64, i32) {
        let bits = x.to_bits();
        let exponent = ((bits >> 52) & 0x7ff) as i32;
        let fraction = (bits & ((1 << 52) - 1)) as i64;
        let (magnitude, exponent) =
            if exponent == 0 { (fraction, 1) } else { (fraction | (1 << 52), exponent) };
        let zeros = magnitude.trailing_zeros().min(52) as i32;
        let magnitude = magnitude >> zeros;
        (if x < 0.0 { -magnitude } else { magnitude }, exponent + zeros)
    };
    let numbers = points.map(|points| points.map(|point| point.map(split)));
    let all = || numbers.iter().flatten().flatten();
    let unit = all().filter(|(m, _)| *m != 0).map(|(_, exponent)| *exponent).min().unwrap_or(0);
    let integer = |(m, exponent): (i64, i32)| -> BigInt {
        if m == 0 { BigInt::default() } else { BigInt::from(m) << (exponent - unit) as usize }
    };
    let numbers = numbers.map(|points| points.map(|point| point.map(integer)));
    let origin = numbers[0][0].clone();
    numbers.map(|points| points.map(|point| std::array::from_fn(|k| &point[k] - &origin[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The triangle (0,0) (4,0) (0,4) at height 0.
    fn above(x: f64, y: f64, z: f64) -> [[f64; 3]; 4] {
        [[x, y, z], [0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]
    }

    fn vertex(start: [f64; 3], end: [f64; 3]) -> bool {
        let [start, end] = [start, end].map(|[x, y, z]| above(x, y, z));
        meets(&start, &end, Split::VertexTriangle)
    }

    #[test]
    fn vertices_meet_triangles() {
        assert!(vertex([1.0, 1.0, 1.0], [1.0, 1.0, -1.0]));
        assert!(!vertex([3.0, 3.0, 1.0], [3.0, 3.0, -1.0]), "beside it");
        assert!(
            vertex([2.0, 2.0, 1.0], [2.0, 2.0, -3.0]),
            "on an edge, at a time of no dyadic fraction"
        );
        assert!(!vertex([2.0 + 1e-15, 2.0, 1.0], [2.0 + 1e-15, 2.0, -3.0]), "just beside it");
        assert!(vertex([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), "at the start");
        assert!(vertex([1.0, 1.0, 1e-300], [1.0, 1.0, 0.0]), "at the end");
        assert!(vertex([-1.0, 1.0, 0.0], [9.0, 1.0, 0.0]), "in its plane");
        assert!(!vertex([-1.0, 5.0, 0.0], [9.0, 5.0, 0.0]), "in its plane, past it");
        assert!(!vertex([1.0, 1.0, 1e-300], [1.0, 1.0, 1e-300]), "at rest");
    }

    #[test]
    fn collapsed_triangles_are_segments() {
        let collapsed = |x: f64, y: f64| [[x, y, 0.0], [0.0; 3], [4.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let crosses = |from: [f64; 2], to: [f64; 2]| {
            let [start, end] = [from, to].map(|[x, y]| collapsed(x, y));
            meets(&start, &end, Split::VertexTriangle)
        };
        assert!(crosses([1.0, 1.0], [1.0, -2.0]));
        assert!(!crosses([5.0, 1.0], [5.0, -2.0]));
        assert!(crosses([5.0, 0.0], [3.0, 0.0]), "along its line");
        assert!(!crosses([6.0, 0.0], [5.0, 0.0]));
        // A triangle that is a segment at one moment, when the vertex is on it.
        let start = [[1.0, 0.0, 0.0], [0.0; 3], [4.0, 0.0, 0.0], [2.0, 2.0, 1.0]];
        let end = [[1.0, 0.0, 0.0], [0.0; 3], [4.0, 0.0, 0.0], [2.0, -2.0, -1.0]];
        assert!(meets(&start, &end, Split::VertexTriangle), "it is on the edge all the time");
        let mut beside = [start, end];
        beside[0][0] = [1.0, 1.0, -1.0];
        beside[1][0] = [1.0, -1.0, 1.0];
        assert!(meets(&beside[0], &beside[1], Split::VertexTriangle));
        beside[0][0] = [5.0, 1.0, -1.0];
        beside[1][0] = [5.0, -1.0, 1.0];
        assert!(!meets(&beside[0], &beside[1], Split::VertexTriangle));
    }

    #[test]
    fn edges_meet_edges() {
        let edges = |x: f64, y: f64, z: f64| {
            [[x - 1.0, y, z], [x + 1.0, y, z], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]
        };
        let meet = |from: [f64; 3], to: [f64; 3]| {
            let [start, end] = [from, to].map(|[x, y, z]| edges(x, y, z));
            meets(&start, &end, Split::EdgeEdge)
        };
        assert!(meet([0.5, 0.0, 1.0], [0.5, 0.0, -1.0]));
        assert!(!meet([1.5, 0.0, 1.0], [1.5, 0.0, -1.0]));
        assert!(meet([1.0, 1.0, 1.0], [1.0, 1.0, -2.0]), "end on end");
        assert!(!meet([1.0, 1.0 + 1e-15, 1.0], [1.0, 1.0 + 1e-15, -2.0]));
        assert!(meet([3.0, 0.5, 0.0], [-3.0, 0.5, 0.0]), "in one plane");
        assert!(!meet([3.0, 1.5, 0.0], [-3.0, 1.5, 0.0]));
        let line = |x: f64| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [5.0, 0.0, 0.0], [6.0, 0.0, 0.0]];
        assert!(meets(&line(0.0), &line(4.0), Split::EdgeEdge), "in one line");
        assert!(!meets(&line(0.0), &line(3.75), Split::EdgeEdge));
        assert!(meets(&line(3.0), &line(9.0), Split::EdgeEdge), "through it");
    }
}
