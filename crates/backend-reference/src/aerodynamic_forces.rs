//! NUMERICS §3, `aerodynamic_forces`: pressure and friction of the air.

use cloth_core::{Inflation, Model, stepper::Substep};

use crate::{Matrix, Number, Particles, Vector, particles::length_min};

/// A triangle in the air.
struct Sail<N> {
    corners: [usize; 3],
    /// rho/2 A/3.
    weight: N,
    pressure: N,
    friction: N,
    normal: Vector<N>,
    /// u . n.
    across: N,
    /// u_t.
    along: Vector<N>,
}

/// Calls `visit` for every triangle that has an area, in order.
fn for_each_sail<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    wind_velocity: [f64; 3],
    mut visit: impl FnMut(Sail<N>),
) {
    let Some(air) = model.air() else { return };
    let [half, third] = [0.5, 1.0 / 3.0].map(N::rounded);
    let (density, wind) = (N::rounded(air.density), Vector::rounded(wind_velocity));
    for cloth in model.cloths() {
        let pressure = N::rounded(cloth.aerodynamics.pressure);
        let friction = N::rounded(cloth.aerodynamics.friction);
        let triangles = cloth.triangles.start as usize..cloth.triangles.end as usize;
        for corners in &model.triangles()[triangles] {
            let corners = corners.map(|corner| corner as usize);
            let [a, b, c] = corners.map(|corner| particles.positions[corner]);
            let area_vector = (b - a).cross(c - a).scaled(half);
            let area = area_vector.length();
            if area.value() == 0.0 {
                continue;
            }
            let normal = area_vector.divided(area);
            let [a, b, c] = corners.map(|corner| particles.velocities[corner]);
            let relative = wind - (a + b + c).scaled(third);
            let across = relative.dot(normal);
            let along = relative - normal.scaled(across);
            let weight = half * density * area * third;
            visit(Sail { corners, weight, pressure, friction, normal, across, along });
        }
    }
}

/// Adds a third of the force on each triangle to each of its corners, that of the air and that of gas within the cloth.
pub fn aerodynamic_forces<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    substep: &Substep,
    forces: &mut [Vector<N>],
) {
    // From zero for each particle, then added.
    let mut sums = vec![Vector::ZERO; forces.len()];
    for_each_sail(model, particles, substep.wind_velocity, |sail| {
        let force = sail.normal.scaled(sail.pressure * sail.across.abs() * sail.across)
            + sail.along.scaled(sail.friction * sail.along.length());
        for corner in sail.corners {
            sums[corner] += force.scaled(sail.weight);
        }
    });
    inflation_forces(model, particles, substep.time, &mut sums);
    for (force, sum) in forces.iter_mut().zip(sums) {
        *force += sum;
    }
}

/// Adds the force of gas under pressure within cloths at `time` \[s\]: a third of p A n of each triangle to each of its corners.
fn inflation_forces<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    time: f64,
    forces: &mut [Vector<N>],
) {
    for (number, cloth) in model.cloths().iter().enumerate() {
        let Some(inflation) = model.inflation(number) else { continue };
        let sixth = N::rounded(inflation.pressure / 6.0) * share(inflation, time);
        for triangle in
            &model.triangles()[cloth.triangles.start as usize..cloth.triangles.end as usize]
        {
            let corners = triangle.map(|corner| corner as usize);
            let [a, b, c] = corners.map(|corner| particles.positions[corner]);
            let share = (b - a).cross(c - a).scaled(sixth);
            corners.iter().for_each(|&corner| forces[corner] += share);
        }
    }
}

/// The share of the pressure that is there at `time`.
fn share<N: Number>(inflation: &Inflation, time: f64) -> N {
    let [start, end] = inflation.rise;
    if time >= end {
        N::ONE
    } else if time <= start {
        N::ZERO
    } else {
        let [start, end, time] = [start, end, time].map(N::rounded);
        (time - start) / (end - start)
    }
}

/// J of every particle \[N s/m\], how the force of the air changes with the velocity (NUMERICS §5).
#[must_use]
pub fn air_jacobians<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    wind_velocity: [f64; 3],
) -> Vec<Matrix<N>> {
    let mut jacobians = vec![Matrix::ZERO; particles.len()];
    for_each_sail(model, particles, wind_velocity, |sail| {
        let speed = sail.along.length();
        let direction = sail.along.divided(speed.max(length_min()));
        let normals = Matrix::outer(sail.normal, sail.normal);
        let tangents =
            Matrix::diagonal(N::ONE) + normals.negated() + Matrix::outer(direction, direction);
        let share = normals.scaled(N::rounded(2.0) * sail.pressure * sail.across.abs())
            + tangents.scaled(sail.friction * speed);
        for corner in sail.corners {
            jacobians[corner] += share.scaled(sail.weight);
        }
    });
    jacobians
}
