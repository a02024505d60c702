//! NUMERICS §12, `bending_forces` and `bending_linearise`: triangles of fabric that resist folds.

use cloth_core::{FabricTriangle, Model, NewtonStart};

use crate::{ElementBlock, Matrix, Number, Particles, Vector};

/// Which places of a patch each edge folds: its ends, the third corner, the vertex beyond.
const FOLDS: [[usize; 4]; 3] = [[0, 1, 2, 3], [1, 2, 0, 4], [2, 0, 1, 5]];

/// A triangle and its neighbours at one time.
struct Patch<N> {
    /// For each fold theta - theta0, d theta/dt, and the derivatives by the six vertices.
    differences: [N; 3],
    rates: [N; 3],
    gradients: [[Vector<N>; 6]; 3],
    /// K.
    stiffness: [[N; 3]; 3],
}

impl<N: Number> Patch<N> {
    fn new(triangle: &FabricTriangle, patch: &[u32; 6], particles: &Particles<N>) -> Self {
        let x = patch.map(|particle| particles.positions[particle as usize]);
        let v = patch.map(|particle| particles.velocities[particle as usize]);
        let mut gradients = [[Vector::ZERO; 6]; 3];
        let mut differences = [N::ZERO; 3];
        for (edge, places) in FOLDS.into_iter().enumerate() {
            let (angle, gradient) = fold(places.map(|place| x[place]));
            differences[edge] = around(angle - N::rounded(triangle.angles[edge]));
            places.into_iter().zip(gradient).for_each(|(p, g)| gradients[edge][p] = g);
        }
        let rate = |edge: usize| {
            let parts = gradients[edge].iter().zip(v).map(|(g, v)| g.dot(v));
            parts.fold(N::ZERO, |sum, part| sum + part)
        };
        let [k00, k11, k22, k01, k02, k12] = triangle.bending.entries.map(N::rounded);
        Self {
            differences,
            rates: [rate(0), rate(1), rate(2)],
            gradients,
            stiffness: [[k00, k01, k02], [k01, k11, k12], [k02, k12, k22]],
        }
    }

    /// K times folds.
    fn moments(&self, folds: [N; 3]) -> [N; 3] {
        self.stiffness.map(|row| row[0] * folds[0] + row[1] * folds[1] + row[2] * folds[2])
    }

    /// Minus moments times gradients, for one vertex.
    fn force(&self, moments: [N; 3], place: usize) -> Vector<N> {
        (0..3).fold(Vector::ZERO, |force, edge| {
            force - self.gradients[edge][place].scaled(moments[edge])
        })
    }

    /// The sum of K_ef grad_e grad_f^T for two places.
    fn block(&self, a: usize, b: usize) -> Matrix<N> {
        let mut block = Matrix::ZERO;
        for e in 0..3 {
            for f in 0..3 {
                let outer = Matrix::outer(self.gradients[e][a], self.gradients[f][b]);
                block += outer.scaled(self.stiffness[e][f]);
            }
        }
        block
    }
}

/// Angle and gradient of the fold of the triangles (0, 1, 2) and (1, 0, 3).
fn fold<N: Number>([x0, x1, x2, x3]: [Vector<N>; 4]) -> (N, [Vector<N>; 4]) {
    let [e, a, b] = [x1 - x0, x2 - x0, x3 - x0];
    let [n1, n2] = [e.cross(a), b.cross(e)];
    let length = e.length();
    let [y, x] = [length * n1.dot(b), n1.dot(n2)];
    let square = x.value() * x.value() + y.value() * y.value();
    let angle = if square > 0.0 { y.value().atan2(x.value()) } else { 0.0 };
    let slopes = if square > 0.0 { [x.value() / square, y.value() / square] } else { [0.0; 2] };
    // The backends' own function is right within two units in the last place.
    let angle = (0..3).fold(N::rounded(angle), |sum, _| sum.as_function_of(N::rounded(angle), 1.0));
    let angle = angle.as_function_of(y, slopes[0]).as_function_of(x, slopes[1]);
    let over = |n: Vector<N>| {
        let square = n.dot(n);
        if square.value() > 0.0 { n.scaled(length / square) } else { Vector::ZERO }
    };
    let [top, bottom] = [over(n1), over(n2)];
    let [w1, w2] = [a.dot(e) / e.dot(e), b.dot(e) / e.dot(e)];
    let start = top.scaled(w1 - N::ONE) + bottom.scaled(w2 - N::ONE);
    (angle, [start, top.scaled(-w1) + bottom.scaled(-w2), top, bottom])
}

/// An angle between -pi and pi, the shorter way around.
fn around<N: Number>(angle: N) -> N {
    let full = N::rounded(std::f64::consts::TAU);
    if angle.value() > std::f64::consts::PI {
        angle - full
    } else if angle.value() < -std::f64::consts::PI {
        angle + full
    } else {
        angle
    }
}

/// Adds the forces of all folded triangles, dampers included.
pub fn bending_forces<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    forces: &mut [Vector<N>],
) {
    let elements = model.elements();
    for (triangle, vertices) in elements.triangles().iter().zip(elements.patches()) {
        let damping = N::rounded(elements.fabrics()[triangle.fabric as usize].damping[1]);
        let patch = Patch::new(triangle, vertices, particles);
        let bent = [0, 1, 2].map(|edge| patch.differences[edge] + damping * patch.rates[edge]);
        let moments = patch.moments(bent);
        for (place, &particle) in vertices.iter().enumerate() {
            forces[particle as usize] += patch.force(moments, place);
        }
    }
}

/// What all folds add to the matrix, and to the right-hand side of each particle, for a substep of `length` \[s\].
#[must_use]
pub fn bending_linearise<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    length: f64,
    start: NewtonStart,
) -> (Vec<ElementBlock<N>>, Vec<Vector<N>>) {
    let elements = model.elements();
    let h = N::rounded(length);
    let mut blocks = Vec::new();
    let mut right_side = vec![Vector::ZERO; particles.len()];
    for (triangle, vertices) in elements.triangles().iter().zip(elements.patches()) {
        let damping = N::rounded(elements.fabrics()[triangle.fabric as usize].damping[1]);
        let patch = Patch::new(triangle, vertices, particles);
        let weight = h * h + h * damping;
        let along = if start == NewtonStart::StepStart { weight } else { h * damping };
        let bent = [0, 1, 2].map(|edge| h * patch.differences[edge] + along * patch.rates[edge]);
        let moments = patch.moments(bent);
        for (a, &row) in vertices.iter().enumerate() {
            right_side[row as usize] += patch.force(moments, a);
            for (b, &column) in vertices.iter().enumerate() {
                let block = patch.block(a, b).scaled(weight);
                blocks.push(ElementBlock { row: row as usize, column: column as usize, block });
            }
        }
    }
    (blocks, right_side)
}

/// Energy of the folds of each triangle \[J\].
pub(crate) fn bending_energies<N: Number>(model: &Model, particles: &Particles<N>) -> Vec<N> {
    let elements = model.elements();
    let one = |(triangle, vertices): (&FabricTriangle, &[u32; 6])| {
        let patch = Patch::new(triangle, vertices, particles);
        let moments = patch.moments(patch.differences);
        let parts = moments.into_iter().zip(patch.differences).map(|(m, fold)| m * fold);
        N::exact(0.5) * parts.fold(N::ZERO, |sum, part| sum + part)
    };
    elements.triangles().iter().zip(elements.patches()).map(one).collect()
}
