//! Bodies that are stopped where cloth would be pinched.
//!
//! The cloth between a body and something else that does not give way has a thickness that nothing goes below, as a body of the
//! library does against another. Such a place is one at which the body may not come nearer: an inelastic contact without friction, whose impulses are found
//! one after the other (Gauss and Seidel's method; Moreau 1988).

use cloth_core::{ColliderImpulse, Pose};
use rapier3d_f64::{
    prelude::{RigidBody as Body, Vector},
    utils::AngularInertiaOps,
};

use crate::{RigidMotion, RigidWorld, mesh::vector, shape::pose};

/// How far from cloth a body is at most that pinches it \[m\], beside the way that it goes.
const REACH: f64 = 0.02;
/// How far a body is from a place that has stopped it \[m\], until the place is forgotten.
const LEFT: f64 = 5e-3;
/// A body that goes no further than this in a step stands still \[m\]: what stops leave of its motion.
const STANDS: f64 = 1e-7;
/// How often all impulses are found again.
const SWEEPS: usize = 30;

/// A place at which a body may not come nearer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    body: usize,
    /// The point of the body \[m\], and the direction against which it came.
    point: [f64; 3],
    normal: [f64; 3],
    /// How fast it is to go that way at least \[m/s\].
    speed: f64,
    /// Whether it stands for a whole side of the body, and is not on its surface.
    is_broad: bool,
}

impl Stop {
    /// The body that is to stop.
    #[must_use]
    pub const fn body(&self) -> usize {
        self.body
    }
}

impl RigidWorld {
    /// The place at which the body nearest to `place` \[m\] is to stop, if it moves and can have come there within `duration` \[s\]. Those
    /// that have all but stopped come last.
    #[must_use]
    pub fn stop_at(&self, place: [f64; 3], duration: f64) -> Option<Stop> {
        let bodies = (0..self.bodies.len()).filter_map(|body| {
            let (point, distance, velocity) = self.nearest(body, place)?;
            // Against the way that it goes: what is beside an edge is pinched by what comes down there as well.
            let stands = velocity.length() * duration <= STANDS;
            let normal = (-velocity.try_normalize()?).to_array();
            let stop = Stop { body, point, normal, speed: 0.0, is_broad: false };
            let is_near = distance <= REACH + velocity.length() * duration;
            is_near.then_some(((stands, distance), stop))
        });
        let nearer = |a: &(bool, f64), b: &(bool, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
        bodies.min_by(|(a, _), (b, _)| nearer(a, b)).map(|(_, stop)| stop)
    }

    /// Where a body that gave cloth an impulse is to go along with it: at its point nearest to `place` \[m\], as fast as the fastest corner of the triangle there, which go by
    /// `velocities` \[m/s\], goes away from the body, or at least not against it; no faster than one of what holds the cloth, which go by `held`, as nothing else has power to give. With
    /// what that takes away \[J\]; nothing where it does so already.
    #[must_use]
    pub fn stop_against(
        &self,
        body: usize,
        impulse: &ColliderImpulse,
        (place, velocities): ([f64; 3], [[f64; 3]; 3]),
        held: &[[f64; 3]],
    ) -> Option<(f64, Stop)> {
        let (point, _, own) = self.nearest(body, place)?;
        let (normal, size) = (-vector(impulse.linear)).normalize_and_length();
        let along = |velocity: &[f64; 3]| normal.dot(vector(*velocity));
        let fastest = |of: &[[f64; 3]]| of.iter().map(along).fold(0.0, f64::max);
        let speed = fastest(&velocities).min(fastest(held));
        let slower = speed - normal.dot(own);
        let stop = Stop { body, point, normal: normal.to_array(), speed, is_broad: false };
        (size > 0.0 && slower > 0.0).then_some((size * slower, stop))
    }

    /// The point of a body \[m\] that is nearest to `place` \[m\], how far that is from there \[m\], and its velocity \[m/s\].
    fn nearest(&self, body: usize, place: [f64; 3]) -> Option<([f64; 3], f64, Vector)> {
        let motion = &self.world.bodies[*self.bodies.get(body)?];
        let collider = &self.world.colliders[*motion.colliders().first()?];
        let place = vector(place);
        let found = collider.shape().project_point(collider.position(), place, false);
        let arm = found.point - motion.center_of_mass();
        let velocity = motion.linvel() + motion.angvel().cross(arm);
        Some((found.point.to_array(), (found.point - place).length(), velocity))
    }

    /// Stops that a body cannot come nearer by turning about one of them either: what lies flat on cloth pinches it in many places at once.
    #[must_use]
    pub fn stop_broadly(&self, stop: &Stop) -> Vec<Stop> {
        let Some(&handle) = self.bodies.get(stop.body) else { return Vec::new() };
        let body = &self.world.bodies[handle];
        let Some(&collider) = body.colliders().first() else { return Vec::new() };
        let size = self.world.colliders[collider].compute_aabb().half_extents().length();
        let (across, along) = vector(stop.normal).any_orthonormal_pair();
        let middle = body.center_of_mass();
        let corners = [across + along, across - along, along - across, -across - along];
        let points = corners.map(|corner| (middle + corner * size).to_array());
        points.map(|point| Stop { point, is_broad: true, ..*stop }).to_vec()
    }

    /// Takes back all of the last step of the bodies that `stops` are about, which began with `before`, one for each body: they are at rest there.
    pub fn halt(&mut self, stops: &[Stop], before: &[RigidMotion]) {
        for (number, (&handle, before)) in self.bodies.iter().zip(before).enumerate() {
            if stops.iter().any(|stop| stop.body == number) {
                let body = &mut self.world.bodies[handle];
                body.set_position(pose(&before.pose), true);
                body.set_linvel(Vector::ZERO, true);
                body.set_angvel(Vector::ZERO, true);
            }
        }
    }

    /// Takes back what bodies have come nearer to `stops` in the last step, which was `duration` \[s\] long and began with `before`, one for each body. Forgets the stops that
    /// bodies have left.
    pub fn stop(&mut self, stops: &mut Vec<Stop>, before: &[RigidMotion], duration: f64) {
        stops.retain(|stop| {
            let Some(&handle) = self.bodies.get(stop.body) else { return false };
            if stop.is_broad {
                return true;
            }
            let body = &self.world.bodies[handle];
            let Some(&collider) = body.colliders().first() else { return false };
            let collider = &self.world.colliders[collider];
            let point = vector(stop.point);
            let found = collider.shape().project_point(body.position(), point, false);
            found.is_inside || (found.point - point).length() <= LEFT
        });
        for ((number, &handle), before) in self.bodies.iter().enumerate().zip(before) {
            let own: Vec<_> = stops.iter().filter(|stop| stop.body == number).collect();
            let body = &mut self.world.bodies[handle];
            if let Some(motion) = stopped(body, &own, &before.pose, duration) {
                body.set_position(pose(&motion.pose), true);
                body.set_linvel(vector(motion.velocity), true);
                body.set_angvel(vector(motion.angular_velocity), true);
            }
        }
    }
}

/// How a body moves that was at `start` and is not to come nearer to `stops`; nothing if it does not by itself.
fn stopped(body: &Body, stops: &[&Stop], start: &Pose, duration: f64) -> Option<RigidMotion> {
    let (mut velocity, mut spin) = (body.linvel(), body.angvel());
    let inverse = body.mass_properties().effective_world_inv_inertia;
    let local = body.mass_properties().local_mprops.local_com;
    let start = pose(start);
    let centre = start.transform_point(local);
    let mut is_stopped = false;
    for _ in 0..SWEEPS {
        for stop in stops {
            let (normal, arm) = (vector(stop.normal), vector(stop.point) - centre);
            let turn = inverse.transform_vector(arm.cross(normal));
            let apart = normal.dot(velocity + spin.cross(arm)) - stop.speed;
            if apart < 0.0 {
                let impulse = -apart / (1.0 / body.mass() + normal.dot(turn.cross(arm)));
                velocity += normal * (impulse / body.mass());
                spin += turn * impulse;
                is_stopped = true;
            }
        }
    }
    is_stopped.then(|| {
        let rotation =
            rapier3d_f64::math::Rotation::from_scaled_axis(spin * duration) * start.rotation;
        let rotation = rotation.normalize();
        let translation = centre + velocity * duration - rotation * local;
        RigidMotion {
            pose: Pose { translation: translation.to_array(), rotation: rotation.to_array() },
            velocity: velocity.to_array(),
            angular_velocity: spin.to_array(),
        }
    })
}
