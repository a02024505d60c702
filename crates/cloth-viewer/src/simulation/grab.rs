//! The spring between the pointer and the cloth.
//!
//! The engine knows no force on single particles, so the spring acts on the velocities of the state, which
//! every backend can take: a frame is cut into short slices, and before each of them the spring gives
//! the particles what it would have given them in that time. It pulls the particle under the pointer
//! and, less, those around it: a single one would be torn out of the cloth.

use cloth::{Model, State};
use glam::DVec3;

use crate::Ray;

use super::pick::Pick;

/// Longest slice \[s\].
pub(super) const SLICE: f64 = 1.0 / 240.0;
/// Angular frequency with which the whole cloth would swing on the spring \[1/s\]: three times a second,
/// so that a cloth that is lifted hangs 3 cm below the pointer.
const FREQUENCY: f64 = std::f64::consts::TAU * 3.0;
/// Radius of what is pulled, in units of the size of the cloth.
const RADIUS: f64 = 0.1;
/// Farthest that the pull may move what it holds in one slice, in units of that radius.
const STEP_MAX: f64 = 0.3;
/// Distance at which the spring pulls hardest, in units of the size of the cloth.
const REACH: f64 = 0.5;

/// A hold on the cloth.
#[derive(Clone, Debug)]
pub(super) struct Grab {
    /// The particle under the pointer.
    pub(super) particle: u32,
    /// Where the pointer pulls it \[m\].
    pub(super) target: [f64; 3],
    /// Distance of the target from the eye \[m\].
    distance: f64,
    /// Particles that are pulled, with weights up to 1.
    weights: Vec<(u32, f64)>,
    /// Sum of their masses by weight \[kg\].
    mass: f64,
    /// Stiffness of the spring \[N/m\].
    stiffness: f64,
    /// Radius of what is pulled, and the longest offset that counts \[m\].
    radius: f64,
    reach: f64,
}

impl Grab {
    pub(super) fn new(model: &Model, positions: &[[f64; 3]], ray: &Ray, pick: Pick) -> Self {
        let cloth = &model.cloths()[model.cloth_of(pick.particle)];
        let range = cloth.particles.start as usize..cloth.particles.end as usize;
        // The rest shape is flat where the present one may be folded: what is near there is near
        // along the cloth.
        let rest = model.positions();
        let bounds = cloth::io::Bounds::of(&rest[range.clone()]);
        let size = (DVec3::from(bounds.max) - DVec3::from(bounds.min)).length();
        let radius = (RADIUS * size).max(1e-9);
        let center = DVec3::from(rest[pick.particle as usize]);
        let weights = cloth.particles.clone().filter_map(|particle| {
            let share = center.distance(rest[particle as usize].into()) / radius;
            (share < 1.0).then(|| (particle, (1.0 - share * share).powi(2)))
        });
        let weights: Vec<(u32, f64)> = weights.collect();
        let masses = model.masses();
        let whole: f64 = masses[range].iter().sum();
        Self {
            particle: pick.particle,
            target: positions[pick.particle as usize],
            distance: pick.distance,
            mass: weights.iter().map(|&(particle, w)| w * masses[particle as usize]).sum(),
            stiffness: whole * FREQUENCY * FREQUENCY,
            weights,
            radius,
            reach: REACH * size,
        }
        .moved(ray)
    }

    /// The same hold with the pointer elsewhere, at the same distance from the eye.
    pub(super) fn moved(mut self, ray: &Ray) -> Self {
        self.target = ray.at(self.distance);
        self
    }

    /// What the spring does to the velocities in `duration` \[s\]: damped critically for what it holds,
    /// and taken at the end of that time (backward Euler), so that no length of time makes it unstable.
    pub(super) fn pull(&self, state: &mut State, duration: f64) {
        let index = self.particle as usize;
        let offset = DVec3::from(self.target) - DVec3::from(state.positions[index]);
        let offset = offset.clamp_length_max(self.reach);
        let velocity = DVec3::from(state.velocities[index]);
        let damping = 2.0 * (self.stiffness * self.mass).sqrt();
        let force = self.stiffness * (offset - duration * velocity) - damping * velocity;
        let inertia = self.mass + duration * damping + duration * duration * self.stiffness;
        let change = duration / inertia.max(f64::MIN_POSITIVE) * force;
        let change = change.clamp_length_max(STEP_MAX * self.radius / duration);
        for &(particle, weight) in &self.weights {
            let particle = particle as usize;
            if state.held[particle] == 0 {
                let velocity = DVec3::from(state.velocities[particle]) + weight * change;
                state.velocities[particle] = velocity.to_array();
            }
        }
    }
}
