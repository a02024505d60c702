//! NUMERICS §12, `bending_forces` and `bending_linearise`: triangles of fabric that resist folds.

use cloth_core::{FabricFold, FabricTriangle, Model, NewtonStart};

use crate::{ElementBlock, Matrix, Number, Particles, Vector};

/// Vertices of a patch, and folds in it.
const VERTICES: usize = 12;
const COUNT: usize = 9;

/// Which places of a patch each fold takes: the ends of the edge, the third corner, the vertex beyond. First the edges of the triangle, then those of
/// the triangles beyond them.
const FOLDS: [[usize; 4]; COUNT] = [
    [0, 1, 2, 3],
    [1, 2, 0, 4],
    [2, 0, 1, 5],
    [0, 3, 1, 6],
    [3, 1, 0, 7],
    [1, 4, 2, 8],
    [4, 2, 1, 9],
    [2, 5, 0, 10],
    [5, 0, 2, 11],
];

/// A triangle and its neighbours at one time.
struct Patch<N> {
    /// For each fold theta - theta0, d theta/dt, and the derivatives by the vertices.
    differences: [N; COUNT],
    rates: [N; COUNT],
    gradients: [[Vector<N>; VERTICES]; COUNT],
    /// The curvatures for the folds.
    map: [[N; COUNT]; 3],
    /// A D.
    plate: [[N; 3]; 3],
}

impl<N: Number> Patch<N> {
    fn new(triangle: &FabricTriangle, patch: &[u32; VERTICES], particles: &Particles<N>) -> Self {
        let x = patch.map(|particle| particles.positions[particle as usize]);
        let v = patch.map(|particle| particles.velocities[particle as usize]);
        let mut gradients = [[Vector::ZERO; VERTICES]; COUNT];
        let mut differences = [N::ZERO; COUNT];
        for (edge, places) in FOLDS.into_iter().enumerate() {
            let (angle, gradient) = fold(places.map(|place| x[place]));
            differences[edge] = around(angle - N::rounded(triangle.angles[edge]));
            places.into_iter().zip(gradient).for_each(|(p, g)| gradients[edge][p] = g);
        }
        let rate = |edge: usize| {
            let parts = gradients[edge].iter().zip(v).map(|(g, v)| g.dot(v));
            parts.fold(N::ZERO, |sum, part| sum + part)
        };
        let [d11, d22, d12, d66] = triangle.bending.plate.map(N::rounded);
        let zero = N::ZERO;
        Self {
            differences,
            rates: std::array::from_fn(rate),
            gradients,
            map: triangle.bending.map.map(|row| row.map(N::rounded)),
            plate: [[d11, d12, zero], [d12, d22, zero], [zero, zero, d66]],
        }
    }

    /// The curvatures for folds.
    fn curvature(&self, folds: [N; COUNT]) -> [N; 3] {
        self.map.map(|row| row.into_iter().zip(folds).fold(N::ZERO, |sum, (k, f)| sum + k * f))
    }

    /// A D times curvatures.
    fn stress(&self, curvature: [N; 3]) -> [N; 3] {
        self.plate.map(|row| row[0] * curvature[0] + row[1] * curvature[1] + row[2] * curvature[2])
    }

    /// The moments of folds.
    fn moments(&self, folds: [N; COUNT]) -> [N; COUNT] {
        let stress = self.stress(self.curvature(folds));
        std::array::from_fn(|fold| {
            (0..3).fold(N::ZERO, |sum, k| sum + self.map[k][fold] * stress[k])
        })
    }

    /// Minus moments times gradients, for one vertex.
    fn force(&self, moments: [N; COUNT], place: usize) -> Vector<N> {
        (0..COUNT).fold(Vector::ZERO, |force, edge| {
            force - self.gradients[edge][place].scaled(moments[edge])
        })
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
        let bent =
            std::array::from_fn(|edge| patch.differences[edge] + damping * patch.rates[edge]);
        let moments = patch.moments(bent);
        for (place, &particle) in vertices.iter().enumerate() {
            forces[particle as usize] += patch.force(moments, place);
        }
    }
}

/// What all folds add to the matrix, and all patches to the right-hand side of each particle, for a substep of `length` \[s\].
#[must_use]
pub fn bending_linearise<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    length: f64,
    start: NewtonStart,
) -> (Vec<ElementBlock<N>>, Vec<Vector<N>>) {
    let elements = model.elements();
    let h = N::rounded(length);
    let mut right_side = vec![Vector::ZERO; particles.len()];
    for (triangle, vertices) in elements.triangles().iter().zip(elements.patches()) {
        let damping = N::rounded(elements.fabrics()[triangle.fabric as usize].damping[1]);
        let patch = Patch::new(triangle, vertices, particles);
        let weight = h * h + h * damping;
        let along = if start == NewtonStart::StepStart { weight } else { h * damping };
        let bent =
            std::array::from_fn(|edge| h * patch.differences[edge] + along * patch.rates[edge]);
        let moments = patch.moments(bent);
        for (place, &row) in vertices.iter().enumerate() {
            right_side[row as usize] += patch.force(moments, place);
        }
    }
    let mut blocks = Vec::new();
    for FabricFold { particles: vertices, stiffness, damping, .. } in elements.folds() {
        let x = vertices.map(|particle| particles.positions[particle as usize]);
        let (_, gradient) = fold(x);
        let weight = h * h * N::rounded(*stiffness) + h * N::rounded(*damping);
        for (&row, of_row) in vertices.iter().zip(gradient) {
            for (&column, of_column) in vertices.iter().zip(gradient) {
                let block = Matrix::outer(of_row, of_column).scaled(weight);
                let (row, column) = (row as usize, column as usize);
                blocks.push(ElementBlock { row, column, block, is_internal: true });
            }
        }
    }
    (blocks, right_side)
}

/// Energy of the folds of each triangle \[J\].
pub(crate) fn bending_energies<N: Number>(model: &Model, particles: &Particles<N>) -> Vec<N> {
    let elements = model.elements();
    let one = |(triangle, vertices): (&FabricTriangle, &[u32; VERTICES])| {
        let patch = Patch::new(triangle, vertices, particles);
        let curvature = patch.curvature(patch.differences);
        let parts = patch.stress(curvature).into_iter().zip(curvature).map(|(m, k)| m * k);
        N::exact(0.5) * parts.fold(N::ZERO, |sum, part| sum + part)
    };
    elements.triangles().iter().zip(elements.patches()).map(one).collect()
}
