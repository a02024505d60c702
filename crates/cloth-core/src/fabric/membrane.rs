//! A triangle of fabric that stretches and shears (NUMERICS §11).

use super::{
    Fabric, FabricError, Locking, TensileCurve,
    vector::{Vector, combination, cross, difference, dot, scaled},
};
use crate::Real;

/// What a triangle is at rest, in the precision of a solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestState<T> {
    /// D_m^-1 \[1/m\], rows: the gradients of the second and third corner in the directions of warp and weft.
    pub inverse: [[T; 2]; 2],
    /// Area \[m^2\].
    pub area: T,
}

/// The elastic law of a fabric, in the precision of a solver. Only a fabric that resists every stretch becomes one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law<T> {
    curves: [Curve<T>; 2],
    coupling: T,
    shear: T,
    lock: Lock<T>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Lock<T> {
    onset: T,
    range: T,
    rise: T,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Curve<T> {
    linear: T,
    cubic: T,
    end: T,
}

/// Green strain and what follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response<T> {
    /// E11, E22, E12, dimensionless.
    pub strain: [T; 3],
    /// Second Piola stress S11, S22, S12 \[N/m\].
    pub stress: [T; 3],
    /// dS11/dE11, dS22/dE22, dS12/(2 dE12) \[N/m\], all positive.
    pub slopes: [T; 3],
    /// Energy per area of the rest state \[J/m^2\].
    pub energy: T,
}

/// Everything of which the 3 x 3 blocks of the energy's Hessian consist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangent<T> {
    /// f_u and f_v.
    pub gradient: [Vector<T>; 2],
    /// Derivatives of the three corners' hat functions by u and v \[1/m\].
    pub corners: [[T; 2]; 3],
    /// A dS11/dE11, A c, A dS22/dE22, A dS12/(2 dE12) \[N m\].
    pub stiffness: [T; 4],
    /// A S+ \[N m\]: 11, 22, 12.
    pub stress: [T; 3],
}

impl<T: Real> Curve<T> {
    fn new(curve: &TensileCurve) -> Self {
        let TensileCurve { linear, cubic, end } = *curve;
        Self { linear: T::from_f64(linear), cubic: T::from_f64(cubic), end: T::from_f64(end) }
    }

    /// Energy, stress and slope at a strain.
    #[inline(always)]
    fn at(&self, strain: T) -> [T; 3] {
        let x = strain.maximum(T::ZERO).minimum(self.end);
        let beyond = (strain - self.end).maximum(T::ZERO);
        let x2 = x * x;
        let steep = self.cubic * x2;
        let three = T::from_f64(3.0);
        let slope = self.linear + three * steep;
        let stress = self.linear * strain + steep * (x + three * beyond);
        let half = T::from_f64(0.5);
        let bent = T::from_f64(0.25) * x2 + beyond * (x + T::from_f64(1.5) * beyond);
        let energy = half * self.linear * strain * strain + steep * bent;
        [energy, stress, slope]
    }
}

impl<T: Real> Lock<T> {
    fn new(locking: Locking) -> Self {
        let Locking { onset, range, rise } = locking;
        Self { onset: T::from_f64(onset), range: T::from_f64(range), rise: T::from_f64(rise) }
    }

    /// Energy, stress and slope at a strain.
    #[inline(always)]
    fn at(&self, strain: T) -> [T; 3] {
        let y = (strain - self.onset).maximum(T::ZERO);
        let x = y.minimum(self.range);
        let beyond = y - x;
        let steep = self.rise * x;
        let third = T::from_f64(1.0 / 3.0);
        let stress = steep * (x + (beyond + beyond));
        let energy = steep * (third * (x * x) + beyond * (x + beyond));
        [energy, stress, steep + steep]
    }
}

impl<T: Real> Law<T> {
    /// The law of a fabric, its numbers rounded once.
    ///
    /// # Errors
    /// What [`Fabric::validate`] finds: a law that is not positive definite does not come to be.
    pub fn new(fabric: &Fabric, owner: &str) -> Result<Self, FabricError> {
        fabric.validate(owner)?;
        Ok(Self {
            curves: [Curve::new(&fabric.warp), Curve::new(&fabric.weft)],
            coupling: T::from_f64(fabric.coupling),
            shear: T::from_f64(fabric.shear),
            lock: Lock::new(fabric.locking()),
        })
    }

    /// Stress and energy at a strain E11, E22, E12.
    #[inline(always)]
    #[must_use]
    pub fn response(&self, strain: [T; 3]) -> Response<T> {
        let [e11, e22, e12] = strain;
        let [energy_u, stress_u, slope_u] = self.curves[0].at(e11);
        let [energy_v, stress_v, slope_v] = self.curves[1].at(e22);
        let (two, half) = (T::from_f64(2.0), T::from_f64(0.5));
        let s12 = two * self.shear * e12;
        let [lock_u, lock_v, lock_w] = [e11, e22, e12.abs()].map(|strain| self.lock.at(strain));
        let across = if e12 < T::ZERO { -lock_w[1] } else { lock_w[1] };
        let locked = lock_u[0] + lock_v[0] + two * lock_w[0];
        Response {
            strain,
            stress: [
                (stress_u + self.coupling * e22) + lock_u[1],
                (stress_v + self.coupling * e11) + lock_v[1],
                s12 + across,
            ],
            slopes: [slope_u + lock_u[2], slope_v + lock_v[2], self.shear + half * lock_w[2]],
            energy: (energy_u + energy_v + self.coupling * e11 * e22 + s12 * e12) + locked,
        }
    }

    /// The viscous stress for a rate of strain \[1/s\], `damping` \[s\] times the tangent C of `response`.
    #[inline(always)]
    #[must_use]
    pub fn viscous_stress(&self, response: &Response<T>, rate: [T; 3], damping: T) -> [T; 3] {
        let [r11, r22, r12] = rate;
        let two = T::from_f64(2.0);
        [
            damping * (response.slopes[0] * r11 + self.coupling * r22),
            damping * (response.slopes[1] * r22 + self.coupling * r11),
            damping * (two * response.slopes[2] * r12),
        ]
    }
}

/// F = \[f_u f_v\] = D_s D_m^-1 of a triangle with these corners \[m\]; of velocities \[m/s\], its rate.
#[inline(always)]
#[must_use]
pub fn deformation<T: Real>(corners: [Vector<T>; 3], rest: &RestState<T>) -> [Vector<T>; 2] {
    let a = difference(corners[1], corners[0]);
    let b = difference(corners[2], corners[0]);
    let [p, q] = rest.inverse;
    [combination(a, p[0], b, q[0]), combination(a, p[1], b, q[1])]
}

/// E = (F^T F - I) / 2: E11, E22, E12.
#[inline(always)]
#[must_use]
pub fn strain<T: Real>([f_u, f_v]: [Vector<T>; 2]) -> [T; 3] {
    let half = T::from_f64(0.5);
    [half * (dot(f_u, f_u) - T::ONE), half * (dot(f_v, f_v) - T::ONE), half * dot(f_u, f_v)]
}

/// dE/dt for F and dF/dt: E11, E22, E12 \[1/s\].
#[inline(always)]
#[must_use]
pub fn strain_rate<T: Real>(
    [f_u, f_v]: [Vector<T>; 2],
    [rate_u, rate_v]: [Vector<T>; 2],
) -> [T; 3] {
    let half = T::from_f64(0.5);
    [dot(f_u, rate_u), dot(f_v, rate_v), half * (dot(f_u, rate_v) + dot(f_v, rate_u))]
}

/// Derivatives of the hat functions of the three corners by u and v \[1/m\]; that of the first makes their sum zero.
#[inline(always)]
#[must_use]
pub fn corner_gradients<T: Real>(rest: &RestState<T>) -> [[T; 2]; 3] {
    let [p, q] = rest.inverse;
    [[-(p[0] + q[0]), -(p[1] + q[1])], p, q]
}

/// Forces on the three corners \[N\]: f_a = -A F S grad phi_a. The first is minus the sum of the others.
#[inline(always)]
#[must_use]
pub fn forces<T: Real>(
    [f_u, f_v]: [Vector<T>; 2],
    stress: [T; 3],
    rest: &RestState<T>,
) -> [Vector<T>; 3] {
    let [s11, s22, s12] = stress;
    let pull_u = scaled(combination(f_u, s11, f_v, s12), -rest.area);
    let pull_v = scaled(combination(f_u, s12, f_v, s22), -rest.area);
    let [p, q] = rest.inverse;
    let second = combination(pull_u, p[0], pull_v, p[1]);
    let third = combination(pull_u, q[0], pull_v, q[1]);
    [std::array::from_fn(|k| -(second[k] + third[k])), second, third]
}

/// Forces on the corners of a triangle \[N\], dampers included, for their positions \[m\] and velocities \[m/s\]. `damping` is that of
/// Rayleigh \[s\].
#[inline(always)]
#[must_use]
pub fn triangle_forces<T: Real>(
    corners: [Vector<T>; 3],
    velocities: [Vector<T>; 3],
    rest: &RestState<T>,
    law: &Law<T>,
    damping: T,
) -> [Vector<T>; 3] {
    let gradient = deformation(corners, rest);
    let response = law.response(strain(gradient));
    let mut stress = response.stress;
    if damping > T::ZERO {
        let rate = strain_rate(gradient, deformation(velocities, rest));
        stress = sum(stress, law.viscous_stress(&response, rate, damping));
    }
    forces(gradient, stress, rest)
}

#[inline(always)]
fn sum<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// What a triangle adds to the matrix and the right-hand side of an implicit step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MembraneTangent<T> {
    /// Its stiffness times h^2, that of C times h^2 + h beta: blocks in \[kg\].
    pub tangent: Tangent<T>,
    /// What it adds to the right-hand side at the three corners \[N s\].
    pub impulses: [Vector<T>; 3],
}

impl<T: Real> MembraneTangent<T> {
    /// For a substep of `length` \[s\]. `from_start` says that the step starts from the present velocities: then the forces change
    /// along the way, by -h^2 K v.
    #[inline(always)]
    #[must_use]
    pub fn new(
        (corners, velocities): ([Vector<T>; 3], [Vector<T>; 3]),
        rest: &RestState<T>,
        law: &Law<T>,
        damping: T,
        length: T,
        from_start: bool,
    ) -> Self {
        let gradient = deformation(corners, rest);
        let response = law.response(strain(gradient));
        let rates = deformation(velocities, rest);
        let rate = strain_rate(gradient, rates);
        let mut tangent = Tangent::new(gradient, law, &response, rest);
        let square = length * length;
        let damped = length * damping;
        let along = if from_start { square + damped } else { damped };
        let viscous = law.viscous_stress(&response, rate, along);
        let stress = sum(response.stress.map(|s| length * s), viscous);
        let mut impulses = forces(gradient, stress, rest);
        if from_start {
            // A S+ is in the tangent, with the area.
            let unit = RestState { inverse: rest.inverse, area: square };
            let turning = forces(rates, tangent.stress, &unit);
            impulses = [0, 1, 2].map(|corner| sum(impulses[corner], turning[corner]));
        }
        tangent.stiffness = tangent.stiffness.map(|k| (square + damped) * k);
        tangent.stress = tangent.stress.map(|s| square * s);
        Self { tangent, impulses }
    }
}

/// A symmetric 2 x 2 matrix (11, 22, 12) without its negative eigenvalues, in closed form.
#[inline(always)]
#[must_use]
pub fn tensile_part<T: Real>([a, b, c]: [T; 3]) -> [T; 3] {
    let half = T::from_f64(0.5);
    let mean = half * (a + b);
    let apart = half * (a - b);
    let radius = (apart * apart + c * c).sqrt();
    let [largest, least] = [mean + radius, mean - radius];
    if least >= T::ZERO {
        return [a, b, c];
    }
    if largest <= T::ZERO {
        return [T::ZERO; 3];
    }
    // Here the eigenvalues differ, so that radius > 0: S+ = largest (S - least) / (largest - least).
    let share = largest / (radius + radius);
    [share * (apart + radius), share * (radius - apart), share * c]
}

impl<T: Real> Tangent<T> {
    /// The tangent of a triangle with this deformation.
    #[inline(always)]
    #[must_use]
    pub fn new(
        gradient: [Vector<T>; 2],
        law: &Law<T>,
        response: &Response<T>,
        rest: &RestState<T>,
    ) -> Self {
        let area = rest.area;
        let [slope_u, slope_v, shear] = response.slopes;
        Self {
            gradient,
            corners: corner_gradients(rest),
            stiffness: [area * slope_u, area * law.coupling, area * slope_v, area * shear],
            stress: tensile_part(response.stress).map(|s| area * s),
        }
    }

    /// The block of corners a and b \[N/m\], row by row; the whole matrix is symmetric and positive semi-definite.
    #[inline(always)]
    #[must_use]
    pub fn block(&self, a: usize, b: usize) -> [Vector<T>; 3] {
        let [f_u, f_v] = self.gradient;
        let [au, av] = self.corners[a];
        let [bu, bv] = self.corners[b];
        let [k11, k12, k22, g] = self.stiffness;
        let [s11, s22, s12] = self.stress;
        let shear_a = combination(f_u, av, f_v, au);
        let shear_b = combination(f_u, bv, f_v, bu);
        // What f_u and f_v are multiplied by for the rows of B_a^T C B_b.
        let along_u = combination(f_u, k11 * bu, f_v, k12 * bv);
        let along_v = combination(f_u, k12 * bu, f_v, k22 * bv);
        let isotropic = au * (s11 * bu + s12 * bv) + av * (s12 * bu + s22 * bv);
        std::array::from_fn(|row| {
            let [pu, pv, ps] = [au * f_u[row], av * f_v[row], g * shear_a[row]];
            std::array::from_fn(|column| {
                let sum = pu * along_u[column] + pv * along_v[column] + ps * shear_b[column];
                if row == column { sum + isotropic } else { sum }
            })
        })
    }
}

/// Principal stretches of a triangle, the larger one first, from its Green strain.
#[inline(always)]
#[must_use]
pub fn principal_stretches<T: Real>([e11, e22, e12]: [T; 3]) -> [T; 2] {
    let two = T::from_f64(2.0);
    let mean = T::ONE + (e11 + e22);
    let apart = e11 - e22;
    let radius = (apart * apart + (two * e12) * (two * e12)).sqrt();
    [(mean + radius).maximum(T::ZERO).sqrt(), (mean - radius).maximum(T::ZERO).sqrt()]
}

/// D_m^-1 and the area of a triangle given by its pattern coordinates \[m\]; `None` without area. The area of a triangle that
/// is turned over in the pattern is positive all the same.
#[must_use]
pub fn rest_state(corners: [[f64; 2]; 3]) -> Option<RestState<f64>> {
    let [a, b, c] = corners;
    let [p, q] = [[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]];
    let third = [c[0] - b[0], c[1] - b[1]];
    let twice = p[0] * q[1] - p[1] * q[0];
    let square = |d: [f64; 2]| d[0] * d[0] + d[1] * d[1];
    let longest = square(p).max(square(q)).max(square(third));
    // The same bound as for triangles in space: a needle so thin that its gradients are rounding noise.
    if twice.is_nan() || twice.abs() <= 1e-10 * longest {
        return None;
    }
    let inverse = [[q[1] / twice, -q[0] / twice], [-p[1] / twice, p[0] / twice]];
    Some(RestState { inverse, area: 0.5 * twice.abs() })
}

/// Pattern coordinates \[m\] of a triangle in space, with u along `warp` as it lies in the triangle's plane; the first corner is the
/// origin. `None` where less than the share `least` of `warp` is in that plane, or the triangle has no area.
#[must_use]
pub fn flattened(
    corners: [Vector<f64>; 3],
    warp: Vector<f64>,
    least: f64,
) -> Option<[[f64; 2]; 3]> {
    let [a, b] = [difference(corners[1], corners[0]), difference(corners[2], corners[0])];
    let normal = cross(a, b);
    let normal = scaled(normal, 1.0 / dot(normal, normal).sqrt());
    let across = cross(normal, warp);
    let length = dot(across, across).sqrt();
    if length.is_nan() || length <= least * dot(warp, warp).sqrt() {
        return None;
    }
    let weft = scaled(across, 1.0 / length);
    let warp = cross(weft, normal);
    Some([[0.0; 2], [dot(a, warp), dot(a, weft)], [dot(b, warp), dot(b, weft)]])
}

impl RestState<f64> {
    /// The same, rounded to the precision of a solver.
    #[must_use]
    pub fn rounded<T: Real>(&self) -> RestState<T> {
        RestState {
            inverse: self.inverse.map(|row| row.map(T::from_f64)),
            area: T::from_f64(self.area),
        }
    }
}
