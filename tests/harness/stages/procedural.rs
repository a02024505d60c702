//! NUMERICS §3: force fields given as expressions, each beside the same formula by hand.

use cloth_backend_reference::{Number, Vector};
use cloth_core::{Field, Model, stepper::Substep};

use super::{ONE, Particles};
use crate::tracked::{Tracked, TrackedVector};

/// What a field reads of one particle.
struct Inputs {
    position: TrackedVector,
    velocity: TrackedVector,
    mass: Tracked,
    particle: usize,
    time: Tracked,
    time_step: Tracked,
}

type Formula = fn(&Inputs) -> TrackedVector;

/// Expressions, and what they mean.
const FORMULAS: &[(&str, Formula)] = &[
    ("-m * x", |at| at.position.scaled(-at.mass)),
    ("let r = length(vec3(x.x, x.y, 0)); cross(vec3(0, 0, 3 * m), x) / (1 + r)", |at| {
        let [x, y, _] = at.position.0;
        let radius = Vector([x, y, Tracked::exact(0.0)]).length();
        let axis = Vector([0.0, 0.0, 3.0].map(Tracked::exact)).scaled(at.mass);
        axis.cross(at.position).divided(ONE + radius)
    }),
    ("0.02 * vec3(sin(10 * x.x + t), cos(x.y), exp(-dot(v, v)))", |at| {
        let [x, y, _] = at.position.0;
        let angle = Tracked::exact(10.0) * x + at.time;
        let [sine, cosine] = [
            function(angle, f64::sin, angle.value.cos(), 2.0),
            function(y, f64::cos, y.value.sin(), 2.0),
        ];
        let argument = -at.velocity.dot(at.velocity);
        let bell = function(argument, f64::exp, argument.value.exp(), 3.0 * argument.value.exp());
        Vector([sine, cosine, bell]).scaled(Tracked::rounded(0.02))
    }),
    ("select(id < 15 and not (id == 3), m * log(1 + abs(x.z)) * v, dt * v.x ^ 3 * x)", |at| {
        if at.particle < 15 && at.particle != 3 {
            let argument = ONE + at.position.0[2].abs();
            let logarithm = argument.value.ln();
            let own = 3.0 * logarithm.abs() + 1.0;
            let logarithm = function(argument, f64::ln, argument.value.recip(), own);
            at.velocity.scaled(at.mass * logarithm)
        } else {
            let v = at.velocity.0[0];
            at.position.scaled(at.time_step * (v * (v * v)))
        }
    }),
    ("m * vec3(noise(4 * x), noise(x + vec3(17.25, 0, t)), (x.y ^ 2 + 0.5) ^ 0.7)", |at| {
        let four = at.position.scaled(Tracked::exact(4.0));
        let shift = Vector([Tracked::exact(17.25), Tracked::exact(0.0), at.time]);
        let base = at.position.0[1] * at.position.0[1] + Tracked::rounded(0.5);
        let power = base.value.powf(0.7);
        let slope = 0.7 * power / base.value;
        let own = (6.0 + 2.0 * base.value.ln().abs()) * power;
        let power = function(base, |a| a.powf(0.7), slope, own);
        Vector([noise(four), noise(at.position + shift), power]).scaled(at.mass)
    }),
];

/// Number of expressions there are.
pub const PROCEDURAL_COUNT: usize = FORMULAS.len();

/// The expression with this number.
#[must_use]
pub fn procedural_source(number: usize) -> &'static str {
    FORMULAS[number % PROCEDURAL_COUNT].0
}

/// A function whose own error is `own`, in units of eps, for an argument with an error.
fn function(argument: Tracked, value: fn(f64) -> f64, slope: f64, own: f64) -> Tracked {
    Tracked { value: value(argument.value), error: argument.error * slope.abs() + own }
}

/// Adds the forces of the procedural fields.
///
/// # Panics
/// For an expression that is none of these here.
pub fn procedural_forces(
    model: &Model,
    particles: &Particles,
    substep: &Substep,
    forces: &mut [TrackedVector],
) {
    for field in model.fields() {
        let Field::Procedural { program } = field else { continue };
        let found = FORMULAS.iter().find(|(source, _)| *source == program.source());
        let Some((_, formula)) = found else { panic!("{program:?} has no formula") };
        for (particle, force) in forces.iter_mut().enumerate() {
            *force += formula(&Inputs {
                position: particles.positions[particle],
                velocity: particles.velocities[particle],
                mass: Tracked::rounded(model.masses()[particle]),
                particle,
                time: Tracked::rounded(substep.time),
                time_step: Tracked::rounded(substep.length),
            });
        }
    }
}

/// Gradient noise: for each of the eight lattice points around, a weight times the offset along its
/// gradient. It has no slope above 3 along any axis.
fn noise(point: TrackedVector) -> Tracked {
    let at = point.values();
    let base = at.map(f64::floor);
    let mut value = 0.0;
    for corner in 0..8_u32 {
        let bit = |axis: usize| f64::from(corner >> axis & 1);
        let mut weight = 1.0;
        let mut offset = [0.0; 3];
        let mut hash = 0_u32;
        for (axis, factor) in [0x9e37_79b1_u32, 0x85eb_ca77, 0xc2b2_ae3d].into_iter().enumerate() {
            offset[axis] = at[axis] - base[axis] - bit(axis);
            let near = 1.0 - offset[axis].abs();
            weight *= near.powi(3) * (near * (near * 6.0 - 15.0) + 10.0);
            hash ^= ((base[axis] + bit(axis)) as i64 as u32).wrapping_mul(factor);
        }
        hash = (hash ^ (hash >> 16)).wrapping_mul(0x7feb_352d);
        hash = (hash ^ (hash >> 15)).wrapping_mul(0x846c_a68b);
        let [x, y, z] = offset;
        // Perlin's table of directions.
        value += weight
            * match (hash ^ (hash >> 16)) & 15 {
                0 | 12 => x + y,
                1 | 14 => y - x,
                2 => x - y,
                3 => -x - y,
                4 => x + z,
                5 => z - x,
                6 => x - z,
                7 => -x - z,
                8 => y + z,
                9 | 13 => z - y,
                10 => y - z,
                _ => -y - z,
            };
    }
    let passed_on: f64 = point.0.iter().map(|component| 3.0 * component.error).sum();
    Tracked { value, error: passed_on + 20.0 }
}
