//! NUMERICS §11, `membrane_forces` and `membrane_linearise`: triangles of fabric that stretch and shear.

use cloth_core::{
    FabricTriangle, Model, NewtonStart,
    fabric::{Fabric, Locking, TensileCurve},
};

use crate::{ElementBlock, Matrix, Number, Particles, Vector};

/// A triangle at one time.
struct Membrane<N> {
    /// f_u, f_v, and their rates.
    gradient: [Vector<N>; 2],
    rate: [Vector<N>; 2],
    /// Derivatives of the corners' hat functions by u and v.
    corners: [[N; 2]; 3],
    area: N,
    /// S11, S22, S12.
    stress: [N; 3],
    /// dS11/dE11, dS22/dE22, c, dS12/(2 dE12).
    stiffness: [N; 4],
}

impl<N: Number> Membrane<N> {
    fn new(fabric: &Fabric, triangle: &FabricTriangle, particles: &Particles<N>) -> Self {
        let [p, q] = triangle.rest.inverse.map(|row| row.map(N::rounded));
        let gradient_of = |vectors: &[Vector<N>]| {
            let [x0, x1, x2] = triangle.particles.map(|particle| vectors[particle as usize]);
            let along = |k: usize| (x1 - x0).scaled(p[k]) + (x2 - x0).scaled(q[k]);
            [along(0), along(1)]
        };
        let gradient = gradient_of(&particles.positions);
        let [f_u, f_v] = gradient;
        let half = N::exact(0.5);
        let [e11, e22, e12] =
            [half * (f_u.dot(f_u) - N::ONE), half * (f_v.dot(f_v) - N::ONE), half * f_u.dot(f_v)];
        let [c, g] = [fabric.coupling, fabric.shear].map(N::rounded);
        let [(stress_u, slope_u), (stress_v, slope_v)] =
            [curve(&fabric.warp, e11), curve(&fabric.weft, e22)];
        let lock = fabric.locking();
        let shear = e12.abs();
        let [(lock_u, steep_u), (lock_v, steep_v), (across, steep_w)] =
            [e11, e22, shear].map(|strain| locked(&lock, strain));
        let across = if e12.value() < 0.0 { N::ZERO - across } else { across };
        Self {
            gradient,
            rate: gradient_of(&particles.velocities),
            corners: [[-(p[0] + q[0]), -(p[1] + q[1])], p, q],
            area: N::rounded(triangle.rest.area),
            stress: [
                stress_u + c * e22 + lock_u,
                stress_v + c * e11 + lock_v,
                N::exact(2.0) * g * e12 + across,
            ],
            stiffness: [slope_u + steep_u, slope_v + steep_v, c, g + half * steep_w],
        }
    }

    /// dE/dt: E11, E22, E12.
    fn strain_rate(&self) -> [N; 3] {
        let ([f_u, f_v], [r_u, r_v]) = (self.gradient, self.rate);
        [f_u.dot(r_u), f_v.dot(r_v), N::exact(0.5) * (f_u.dot(r_v) + f_v.dot(r_u))]
    }

    /// C times a strain.
    fn elastic(&self, [e11, e22, e12]: [N; 3]) -> [N; 3] {
        let [slope_u, slope_v, c, g] = self.stiffness;
        [slope_u * e11 + c * e22, slope_v * e22 + c * e11, N::exact(2.0) * g * e12]
    }

    /// -A F S grad(phi_a) for one corner.
    fn force(&self, [f_u, f_v]: [Vector<N>; 2], [s11, s22, s12]: [N; 3], a: usize) -> Vector<N> {
        let [u, v] = self.corners[a];
        let pull = f_u.scaled(s11 * u + s12 * v) + f_v.scaled(s12 * u + s22 * v);
        pull.scaled(-self.area)
    }

    /// S+, the stress without its negative eigenvalue.
    fn tensile(&self) -> [N; 3] {
        let [s11, s22, s12] = self.stress;
        let half = N::exact(0.5);
        let [mean, apart] = [half * (s11 + s22), half * (s11 - s22)];
        let radius = (apart * apart + s12 * s12).sqrt();
        let [largest, least] = [mean + radius, mean - radius];
        if least.value() >= 0.0 {
            return self.stress;
        }
        if largest.value() <= 0.0 {
            return [N::ZERO; 3];
        }
        let share = largest / (radius + radius);
        [share * (apart + radius), share * (radius - apart), share * s12]
    }

    /// A [`along` B_a^T C B_b + `beside` (grad phi_a . S+ grad phi_b) I].
    fn block(&self, a: usize, b: usize, along: N, beside: N) -> Matrix<N> {
        let [f_u, f_v] = self.gradient;
        let ([au, av], [bu, bv]) = (self.corners[a], self.corners[b]);
        let [slope_u, slope_v, c, g] = self.stiffness;
        let shear = |u: N, v: N| f_u.scaled(v) + f_v.scaled(u);
        let elastic = Matrix::outer(f_u, f_u).scaled(slope_u * au * bu)
            + Matrix::outer(f_v, f_v).scaled(slope_v * av * bv)
            + Matrix::outer(f_u, f_v).scaled(c * au * bv)
            + Matrix::outer(f_v, f_u).scaled(c * av * bu)
            + Matrix::outer(shear(au, av), shear(bu, bv)).scaled(g);
        let [s11, s22, s12] = self.tensile();
        let turning = au * (s11 * bu + s12 * bv) + av * (s12 * bu + s22 * bv);
        (elastic.scaled(along) + Matrix::diagonal(beside * turning)).scaled(self.area)
    }
}

/// psi' and psi'' of a curve.
fn curve<N: Number>(curve: &TensileCurve, strain: N) -> (N, N) {
    let [linear, cubic, end] = [curve.linear, curve.cubic, curve.end].map(N::rounded);
    let x = strain.max(N::ZERO).min(end);
    let beyond = (strain - end).max(N::ZERO);
    let square = x * x;
    let three = N::exact(3.0);
    let stress = linear * strain + cubic * square * (x + three * beyond);
    (stress, linear + three * cubic * square)
}

/// Stress of threads that jam, and its slope.
fn locked<N: Number>(lock: &Locking, strain: N) -> (N, N) {
    let [onset, range, rise] = [lock.onset, lock.range, lock.rise].map(N::rounded);
    let beyond_onset = (strain - onset).max(N::ZERO);
    let x = beyond_onset.min(range);
    let steep = rise * x;
    (steep * (x + N::exact(2.0) * (beyond_onset - x)), N::exact(2.0) * steep)
}

fn sum<N: Number>(a: [N; 3], b: [N; 3], factor: N) -> [N; 3] {
    [0, 1, 2].map(|k| a[k] + factor * b[k])
}

/// Adds the forces of all triangles, dampers included.
pub fn membrane_forces<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    forces: &mut [Vector<N>],
) {
    for triangle in model.elements().triangles() {
        let fabric = &model.elements().fabrics()[triangle.fabric as usize];
        let membrane = Membrane::new(fabric, triangle, particles);
        let viscous = membrane.elastic(membrane.strain_rate());
        let stress = sum(membrane.stress, viscous, N::rounded(fabric.damping[0]));
        for (a, &particle) in triangle.particles.iter().enumerate() {
            forces[particle as usize] += membrane.force(membrane.gradient, stress, a);
        }
    }
}

/// What all triangles add to the matrix, and to the right-hand side of each particle, for a substep of `length` \[s\].
#[must_use]
pub fn membrane_linearise<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    length: f64,
    start: NewtonStart,
) -> (Vec<ElementBlock<N>>, Vec<Vector<N>>) {
    let h = N::rounded(length);
    let mut blocks = Vec::new();
    let mut right_side = vec![Vector::ZERO; particles.len()];
    for triangle in model.elements().triangles() {
        let fabric = &model.elements().fabrics()[triangle.fabric as usize];
        let membrane = Membrane::new(fabric, triangle, particles);
        let damping = N::rounded(fabric.damping[0]);
        let from_start = start == NewtonStart::StepStart;
        let along = if from_start { h * h + h * damping } else { h * damping };
        let viscous = membrane.elastic(membrane.strain_rate());
        let stress = sum(membrane.stress.map(|s| h * s), viscous, along);
        for (a, &row) in triangle.particles.iter().enumerate() {
            let mut impulse = membrane.force(membrane.gradient, stress, a);
            if from_start {
                impulse += membrane.force(membrane.rate, membrane.tensile(), a).scaled(h * h);
            }
            right_side[row as usize] += impulse;
            for (b, &column) in triangle.particles.iter().enumerate() {
                let block = membrane.block(a, b, h * h + h * damping, h * h);
                let (row, column) = (row as usize, column as usize);
                blocks.push(ElementBlock { row, column, block, is_internal: true });
            }
        }
    }
    (blocks, right_side)
}

/// Energy \[J\] and larger principal stretch of each triangle.
pub(crate) fn membrane_figures<N: Number>(model: &Model, particles: &Particles<N>) -> Vec<(N, N)> {
    let elements = model.elements();
    let one = |triangle: &FabricTriangle| {
        let fabric = &elements.fabrics()[triangle.fabric as usize];
        let membrane = Membrane::new(fabric, triangle, particles);
        let [f_u, f_v] = membrane.gradient;
        let half = N::exact(0.5);
        let [e11, e22, e12] =
            [half * (f_u.dot(f_u) - N::ONE), half * (f_v.dot(f_v) - N::ONE), half * f_u.dot(f_v)];
        let [c, g] = [fabric.coupling, fabric.shear].map(N::rounded);
        let stored = curve_energy(&fabric.warp, e11)
            + curve_energy(&fabric.weft, e22)
            + c * e11 * e22
            + N::exact(2.0) * g * e12 * e12;
        let lock = fabric.locking();
        let shear = e12.abs();
        let [u, v, w] = [e11, e22, shear].map(|strain| locked_energy(&lock, strain));
        let stored = stored + (u + v + N::exact(2.0) * w);
        // A vector of two numbers has the length of the difference of the principal values.
        let apart = N::length([e11 - e22, N::exact(2.0) * e12, N::ZERO]);
        let stretch = (N::ONE + (e11 + e22) + apart).max(N::ZERO).sqrt();
        (membrane.area * stored, stretch)
    };
    elements.triangles().iter().map(one).collect()
}

/// Energy of threads that jam.
fn locked_energy<N: Number>(lock: &Locking, strain: N) -> N {
    let [onset, range, rise] = [lock.onset, lock.range, lock.rise].map(N::rounded);
    let y = (strain - onset).max(N::ZERO);
    let x = y.min(range);
    let beyond = y - x;
    rise * x * (N::rounded(1.0 / 3.0) * x * x + beyond * (x + beyond))
}

/// psi of a curve.
fn curve_energy<N: Number>(curve: &TensileCurve, strain: N) -> N {
    let [linear, cubic, end] = [curve.linear, curve.cubic, curve.end].map(N::rounded);
    let x = strain.max(N::ZERO).min(end);
    let y = (strain - end).max(N::ZERO);
    let [half, quarter] = [0.5, 0.25].map(N::exact);
    half * linear * strain * strain
        + cubic * x * x * (quarter * x * x + y * (x + N::exact(1.5) * y))
}
