//! Bodies that are stopped where cloth would be pinched.
//!
//! The cloth between a body and something else that does not give way has a thickness that nothing goes below, as a body of the
//! library does against another. Such a place is one at which the body may not come nearer: an inelastic contact without friction, whose impulses are found
//! one after the other (Gauss and Seidel's method; Moreau 1988).

use cloth_core::Pose;
use rapier3d_f64::{prelude::RigidBody as Body, utils::AngularInertiaOps};

use crate::{RigidMotion, RigidWorld, mesh::vector, shape::pose};

/// How far from cloth a body is at most that pinches it \[m\], beside the way that it goes.
const REACH: f64 = 0.02;
/// How far a body is from a place that has stopped it \[m\], until the place is forgotten.
const LEFT: f64 = 5e-3;
/// How often all impulses are found again.
const SWEEPS: usize = 30;

/// A place at which a body may not come nearer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    body: usize,
    /// The point of the body \[m\], and the direction against which it came.
    point: [f64; 3],
    normal: [f64; 3],
    /// Whether it stands for a whole side of the body, and is not on its surface.
    is_broad: bool,
}

impl RigidWorld {
    /// The place at which the body nearest to `place` \[m\] is to stop, if it moves and can have come there within `duration` \[s\].
    #[must_use]
    pub fn stop_at(&self, place: [f64; 3], duration: f64) -> Option<Stop> {
        let bodies = (0..self.bodies.len()).filter_map(|body| {
            let (stop, distance) = self.stop_of(body, place)?;
            let motion = &self.world.bodies[self.bodies[body]];
            let arm = vector(stop.point) - motion.center_of_mass();
            let speed = (motion.linvel() + motion.angvel().cross(arm)).length();
            (distance <= REACH + speed * duration).then_some((distance, stop))
        });
        bodies.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, stop)| stop)
    }

    /// The place nearest to `place` \[m\] at which a body is to stop, if it moves there, and how far that is from there \[m\].
    #[must_use]
    pub fn stop_of(&self, body: usize, place: [f64; 3]) -> Option<(Stop, f64)> {
        let motion = &self.world.bodies[*self.bodies.get(body)?];
        let collider = &self.world.colliders[*motion.colliders().first()?];
        let place = vector(place);
        let found = collider.shape().project_point(collider.position(), place, false);
        let arm = found.point - motion.center_of_mass();
        let velocity = motion.linvel() + motion.angvel().cross(arm);
        // Against the way that it goes: what is beside an edge is pinched by what comes down there as well.
        let normal = -velocity.try_normalize()?;
        let [point, normal] = [found.point, normal].map(|vector| vector.to_array());
        let stop = Stop { body, point, normal, is_broad: false };
        Some((stop, (found.point - place).length()))
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
            let apart = normal.dot(velocity + spin.cross(arm));
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
