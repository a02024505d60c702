//! Two triangles of fabric that fold about the edge between them (NUMERICS §12).

use std::f64::consts::PI;

use super::{
    arctangent::arctangent2,
    vector::{Vector, combination, cross, difference, dot, scaled},
};
use crate::Real;

/// How far two triangles are folded, and how that changes with their corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold<T> {
    /// Angle between the normals \[rad\], in \[-pi, pi\]: positive where the triangles rise on the side to which the normals point.
    pub angle: T,
    /// Its derivatives by the four vertices \[1/m\]; their sum is zero.
    pub gradient: [Vector<T>; 4],
    /// Where the feet of the heights of both triangles lie on the edge: 0 at vertex 0, 1 at vertex 1. With the derivatives by the third vertices they tell
    /// the other two.
    pub feet: [T; 2],
}

/// The fold of the triangles (0, 1, 2) and (1, 0, 3) about their edge 0-1. Triangles without area have no normal: their angle is
/// zero, and so is the gradient of what lies on the edge.
#[inline(always)]
#[must_use]
pub fn fold<T: Real>(vertices: [Vector<T>; 4]) -> Fold<T> {
    let [x0, x1, x2, x3] = vertices;
    let [e, a, b] = [difference(x1, x0), difference(x2, x0), difference(x3, x0)];
    let [n1, n2] = [cross(e, a), cross(b, e)];
    let square = dot(e, e);
    let length = square.sqrt();
    let angle = arctangent2(length * dot(n1, b), dot(n1, n2));
    let over = |value: T, square: T| value / square.maximum(T::MIN_POSITIVE);
    let apex1 = scaled(n1, over(length, dot(n1, n1)));
    let apex2 = scaled(n2, over(length, dot(n2, n2)));
    // Where the feet of the apexes lie on the edge: 0 at vertex 0, 1 at vertex 1.
    let [w1, w2] = [over(dot(a, e), square), over(dot(b, e), square)];
    Fold { angle, gradient: gradient_of(apex1, apex2, [w1, w2]), feet: [w1, w2] }
}

/// The derivatives of a fold by its four vertices, of which those by the third vertices of both triangles, and the feet of their heights, are known.
#[inline(always)]
#[must_use]
pub fn gradient_of<T: Real>(
    apex1: Vector<T>,
    apex2: Vector<T>,
    [w1, w2]: [T; 2],
) -> [Vector<T>; 4] {
    let end0 = combination(apex1, w1 - T::ONE, apex2, w2 - T::ONE);
    let end1 = combination(apex1, -w1, apex2, -w2);
    [end0, end1, apex1, apex2]
}

/// How far a fold is from its rest angle \[rad\], the shorter way around.
#[inline(always)]
#[must_use]
pub fn difference_of_angles<T: Real>(angle: T, rest_angle: T) -> T {
    let difference = angle - rest_angle;
    let [half, full] = [T::from_f64(PI), T::from_f64(2.0 * PI)];
    if difference > half {
        difference - full
    } else if difference < -half {
        difference + full
    } else {
        difference
    }
}

/// Energy k (theta - theta0)^2 / 2 \[J\] of one hinge on its own, and its moment k (theta - theta0) \[N m\].
#[inline(always)]
#[must_use]
pub fn energy_and_moment<T: Real>(stiffness: T, difference: T) -> [T; 2] {
    let moment = stiffness * difference;
    [T::from_f64(0.5) * moment * difference, moment]
}

impl<T: Real> Fold<T> {
    /// Forces on the four vertices for a moment \[N\]: -moment gradient.
    #[inline(always)]
    #[must_use]
    pub fn forces(&self, moment: T) -> [Vector<T>; 4] {
        self.gradient.map(|gradient| scaled(gradient, -moment))
    }

    /// The Gauss-Newton block k grad_a grad_b^T of vertices a and b \[N/m\], row by row: of rank one, so never indefinite.
    #[inline(always)]
    #[must_use]
    pub fn block(&self, stiffness: T, a: usize, b: usize) -> [Vector<T>; 3] {
        self.gradient[a].map(|entry| scaled(self.gradient[b], stiffness * entry))
    }
}
