//! The base of the ladder: one thread of the processor, every particle compared with every other.

use std::time::Instant;

use cloth::{Result, State};

use super::{
    FRAME, LadderRun, model,
    workload::{Constants, Neighbour, Particle, SUBSTEPS},
};

type Vector = [f32; 3];

fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Adds `scale` times a vector.
fn add(sum: &mut Vector, scale: f32, vector: Vector) {
    for (sum, component) in sum.iter_mut().zip(vector) {
        *sum += scale * component;
    }
}

/// Shortest length that is divided by \[m\], and the square below which a pair has no normal \[m^2\].
const LENGTH_MIN: f32 = 1e-18;
const LENGTH_SQUARED_MIN: f32 = 1e-14;

fn spring_add(
    c: &Constants,
    spring: &Neighbour,
    own: &Particle,
    other: &Particle,
    sum: &mut Vector,
) {
    let d = minus(other.position, own.position);
    let length = dot(d, d).sqrt();
    let n = d.map(|component| component / length.max(LENGTH_MIN));
    let rate = dot(minus(other.velocity, own.velocity), n);
    add(sum, spring.stiffness * (length - spring.rest_length) + c.damping * rate, n);
}

fn contact_add(c: &Constants, own: &Particle, other: &Particle, sum: &mut Vector) {
    let d = minus(own.position, other.position);
    let squared = dot(d, d);
    if squared >= c.contact_distance * c.contact_distance || squared <= LENGTH_SQUARED_MIN {
        return;
    }
    let length = squared.sqrt();
    let n = d.map(|component| component / length);
    let rate = dot(minus(own.velocity, other.velocity), n);
    add(sum, c.contact_stiffness * (c.contact_distance - length) - c.contact_damping * rate, n);
}

fn collide(c: &Constants, particle: &mut Particle) {
    let d = minus(particle.position, c.sphere_centre);
    let length = dot(d, d).sqrt();
    let depth = 0.5 * c.contact_distance - (length - c.sphere_radius);
    // Also for NaN.
    if depth.is_nan() || depth <= 0.0 {
        return;
    }
    let n = d.map(|component| component / length.max(LENGTH_MIN));
    add(&mut particle.position, depth, n);
    let approach = dot(particle.velocity, n);
    if approach >= 0.0 {
        return;
    }
    let mut along = particle.velocity;
    add(&mut along, -approach, n);
    let speed = dot(along, along).sqrt().max(LENGTH_MIN);
    let kept = (1.0 - c.sphere_friction * approach.abs() / speed).max(0.0);
    particle.velocity = along.map(|component| kept * component);
}

/// One substep of particle `i`.
fn advance(c: &Constants, particles: &[Particle], i: usize) -> Particle {
    let mut own = particles[i];
    let mut force = own.velocity.map(|component| -own.mass * c.drag_rate * component);
    force[2] += own.mass * c.gravity;
    let side = c.side as i32;
    let [column, row] = [i as i32 % side, i as i32 / side];
    for spring in &c.neighbours {
        let [x, y] = [column + spring.across, row + spring.up];
        if (0..side).contains(&x) && (0..side).contains(&y) {
            spring_add(c, spring, &own, &particles[(y * side + x) as usize], &mut force);
        }
    }
    let mut contact = [0.0; 3];
    for (j, other) in particles.iter().enumerate() {
        if j != i {
            contact_add(c, &own, other, &mut contact);
        }
    }
    add(&mut force, 1.0, contact);
    add(&mut own.velocity, c.length * own.inverse_mass, force);
    let velocity = own.velocity;
    add(&mut own.position, c.length, velocity);
    collide(c, &mut own);
    own
}

/// Some frames of a patch of `side` x `side` particles on one thread of the processor.
///
/// # Errors
/// [`Error::Invalid`](cloth::Error) if the side is below two or the state is not of this patch;
/// `LimitExceeded` above [`SIDE_MAX`](super::SIDE_MAX).
pub fn single_thread(side: u32, state: &State, frames: usize) -> Result<LadderRun> {
    state.validate(&model(side)?)?;
    let constants = Constants::new(side, 0);
    let mut from = particles(&constants, state);
    let mut to = from.clone();
    let mut run = LadderRun { state: state.clone(), frame_seconds: Vec::with_capacity(frames) };
    for _ in 0..frames {
        let start = Instant::now();
        for _ in 0..SUBSTEPS {
            for (i, particle) in to.iter_mut().enumerate() {
                *particle = advance(&constants, &from, i);
            }
            std::mem::swap(&mut from, &mut to);
        }
        run.frame_seconds.push(start.elapsed().as_secs_f64());
    }
    state_of(&from, frames, &mut run.state);
    Ok(run)
}

/// A state as an array of structs.
pub(super) fn particles(constants: &Constants, state: &State) -> Vec<Particle> {
    let mass = constants.mass();
    let both = state.positions.iter().zip(&state.velocities);
    both.map(|(x, v)| Particle {
        position: x.map(|component| component as f32),
        mass,
        velocity: v.map(|component| component as f32),
        inverse_mass: mass.recip(),
    })
    .collect()
}

/// The other way, some frames later.
pub(super) fn state_of(particles: &[Particle], frames: usize, state: &mut State) {
    for (i, particle) in particles.iter().enumerate() {
        state.positions[i] = particle.position.map(f64::from);
        state.velocities[i] = particle.velocity.map(f64::from);
    }
    state.time += frames as f64 * FRAME;
    state.step += (frames * SUBSTEPS) as u64;
}
