//! NUMERICS §3: the force of the air on triangles.

use cloth_core::{Model, Real, stepper::Substep};
use rayon::prelude::*;

use crate::{
    memory::Motion,
    triangles::TriangleRows,
    vector::{cross, dot, sub},
};

/// A third of the force on each triangle \[N\], and who receives it.
#[derive(Debug)]
pub(crate) struct Aerodynamics<T> {
    shares: Vec<[T; 3]>,
    /// The derivative of a share by the velocity of the triangle; empty until it is asked for.
    jacobians: Vec<[T; 6]>,
    rows: TriangleRows,
}

impl<T: Real> Aerodynamics<T> {
    /// Memory for a model with air.
    pub(crate) fn new(model: &Model) -> Option<Self> {
        model.air()?;
        Some(Self {
            shares: vec![[T::ZERO; 3]; model.triangles().len()],
            jacobians: Vec::new(),
            rows: TriangleRows::new(model),
        })
    }

    /// Computes the force on every triangle in the wind of a substep, and that of the gas within.
    pub(crate) fn update(&mut self, model: &Model, motion: &Motion<T>, substep: &Substep) {
        for_each_triangle(model, motion, substep.wind_velocity, &mut self.shares, triangle);
        for (number, cloth) in model.cloths().iter().enumerate() {
            let Some(inflation) = model.inflation(number) else { continue };
            let share = inflation.share(T::from_f64(substep.time));
            let sixth = T::from_f64(inflation.pressure / 6.0) * share;
            let range = cloth.triangles.start as usize..cloth.triangles.end as usize;
            self.shares[range.clone()]
                .par_iter_mut()
                .with_min_len(1024)
                .zip(&model.triangles()[range])
                .for_each(|(share, corners)| {
                    let x = corners.map(|vertex| motion.position.get(vertex as usize));
                    let doubled = cross(sub(x[1], x[0]), sub(x[2], x[0]));
                    for axis in 0..3 {
                        share[axis] += sixth * doubled[axis];
                    }
                });
        }
    }

    /// Computes the derivative of the force on every triangle by its velocity, as `update` does the
    /// force.
    pub(crate) fn linearise(&mut self, model: &Model, motion: &Motion<T>, wind_velocity: [f64; 3]) {
        self.jacobians.resize(model.triangles().len(), [T::ZERO; 6]);
        for_each_triangle(model, motion, wind_velocity, &mut self.jacobians, triangle_jacobian);
    }

    /// J of NUMERICS §5 for a particle, as xx, yy, zz, xy, xz, yz \[N s/m\].
    pub(crate) fn jacobian(&self, particle: usize) -> [T; 6] {
        let mut sum = [T::ZERO; 6];
        for &triangle in self.rows.row(particle) {
            for (sum, entry) in sum.iter_mut().zip(self.jacobians[triangle as usize]) {
                *sum += entry;
            }
        }
        sum
    }

    /// Force on a particle \[N\].
    #[inline(always)]
    pub(crate) fn force(&self, particle: usize) -> [T; 3] {
        let mut sum = [T::ZERO; 3];
        for &triangle in self.rows.row(particle) {
            let share = self.shares[triangle as usize];
            for axis in 0..3 {
                sum[axis] += share[axis];
            }
        }
        sum
    }
}

/// Sets an entry for every triangle: from the air around it and half the density times its coefficients of
/// pressure and friction.
fn for_each_triangle<T: Real, E: Send>(
    model: &Model,
    motion: &Motion<T>,
    wind_velocity: [f64; 3],
    entries: &mut [E],
    entry_of: impl Fn([[T; 3]; 3], [[T; 3]; 3], [T; 3], T, T) -> E + Sync,
) {
    let Some(air) = model.air() else { return };
    let wind = wind_velocity.map(T::from_f64);
    let half_density = T::from_f64(0.5 * air.density);
    for cloth in model.cloths() {
        let pressure = half_density * T::from_f64(cloth.aerodynamics.pressure);
        let friction = half_density * T::from_f64(cloth.aerodynamics.friction);
        let range = cloth.triangles.start as usize..cloth.triangles.end as usize;
        entries[range.clone()]
            .par_iter_mut()
            .with_min_len(1024)
            .zip(&model.triangles()[range])
            .for_each(|(entry, corners)| {
                let x = corners.map(|vertex| motion.position.get(vertex as usize));
                let v = corners.map(|vertex| motion.velocity.get(vertex as usize));
                *entry = entry_of(x, v, wind, pressure, friction);
            });
    }
}

/// A third of the force on one triangle \[N\].
#[inline(always)]
fn triangle<T: Real>(
    x: [[T; 3]; 3],
    v: [[T; 3]; 3],
    wind: [T; 3],
    pressure: T,
    friction: T,
) -> [T; 3] {
    let third = T::from_f64(1.0 / 3.0);
    let Flow { area, normal, across, along, speed } = Flow::new(x, v, wind);
    std::array::from_fn(|axis| {
        let force =
            pressure * across.abs() * across * normal[axis] + friction * speed * along[axis];
        area * force * third
    })
}

/// Minus the derivative of [`triangle`] by the mean velocity of the corners, as xx, yy, zz, xy, xz,
/// yz \[N s/m\].
#[inline(always)]
fn triangle_jacobian<T: Real>(
    x: [[T; 3]; 3],
    v: [[T; 3]; 3],
    wind: [T; 3],
    pressure: T,
    friction: T,
) -> [T; 6] {
    let third = T::from_f64(1.0 / 3.0);
    let Flow { area, normal, across, along, speed } = Flow::new(x, v, wind);
    let inverse = T::ONE / speed.maximum(T::LENGTH_MIN);
    let direction = along.map(|component| component * inverse);
    let normal_factor = (T::ONE + T::ONE) * pressure * across.abs();
    let tangential_factor = friction * speed;
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(row, column)| {
        let identity = if row == column { T::ONE } else { T::ZERO };
        let normals = normal[row] * normal[column];
        let tangents = direction[row] * direction[column];
        let entry = normal_factor * normals + tangential_factor * (identity - normals + tangents);
        area * entry * third
    })
}

/// The air relative to a triangle.
struct Flow<T> {
    area: T,
    normal: [T; 3],
    /// Velocity along the normal \[m/s\].
    across: T,
    /// Velocity in the plane \[m/s\], and its magnitude.
    along: [T; 3],
    speed: T,
}

impl<T: Real> Flow<T> {
    #[inline(always)]
    fn new(x: [[T; 3]; 3], v: [[T; 3]; 3], wind: [T; 3]) -> Self {
        let third = T::from_f64(1.0 / 3.0);
        let doubled = cross(sub(x[1], x[0]), sub(x[2], x[0]));
        let length = dot(doubled, doubled).sqrt();
        let area = length * T::from_f64(0.5);
        let inverse = T::ONE / length.maximum(T::LENGTH_MIN);
        let normal = doubled.map(|component| component * inverse);
        let relative: [T; 3] =
            std::array::from_fn(|axis| wind[axis] - (v[0][axis] + v[1][axis] + v[2][axis]) * third);
        let across = dot(relative, normal);
        let along: [T; 3] = std::array::from_fn(|axis| relative[axis] - across * normal[axis]);
        let speed = dot(along, along).sqrt();
        Self { area, normal, across, along, speed }
    }
}
