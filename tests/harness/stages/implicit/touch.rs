//! NUMERICS §5: one contact of a particle with a collider, and what a solve says of it.

use super::{super::ZERO, TrackedMatrix};
use crate::tracked::{Tracked, TrackedVector};

/// Contact with one collider.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Number of the collider.
    pub(super) collider: usize,
    pub(super) normal: TrackedVector,
    /// Velocity along the normal that is asked for.
    pub(super) speed: Tracked,
    /// Velocity of the collider.
    pub(super) surface: TrackedVector,
    friction: Tracked,
    pub(super) sticks: bool,
    /// c, zero while it sticks.
    pub(super) drag: Tracked,
}

/// A particle after a solve.
pub(super) struct Solved {
    /// lambda
    pub(super) impulse: TrackedVector,
    /// v'
    pub(super) velocity: TrackedVector,
    pub(super) mass: Tracked,
    /// D
    pub(super) inertia: TrackedMatrix,
}

/// What becomes of a contact.
pub(super) enum Outcome {
    Stands,
    /// It slides on with this drag.
    Corrected(Tracked),
    /// It begins to slide with this drag.
    Slips(Tracked),
    Pulls,
}

impl Touch {
    /// The contact of a particle with the collider of this number that lets it come as near as `largest`, its
    /// velocity along the normal, and whether rounding decides what it is like.
    pub(super) fn new(
        (collider, normal, largest): (usize, TrackedVector, Tracked),
        mass: Tracked,
        [velocity, predicted, surface]: [TrackedVector; 3],
        [restitution, friction]: [Tracked; 2],
        epsilon: f64,
    ) -> (Self, bool) {
        let carried = surface.dot(normal);
        let approach = (velocity - surface).dot(normal);
        let mut speed = largest.min(carried);
        let mut uncertain = false;
        if restitution.value > 0.0 {
            uncertain = approach.is_close(ZERO, epsilon);
            if approach.value < 0.0 {
                speed = speed.max(carried - restitution * approach);
            }
        }
        let slip = along(predicted - surface, normal).length();
        let holds = friction * (speed - predicted.dot(normal));
        uncertain |= slip.is_close(holds, epsilon);
        let sticks = slip.value <= holds.value;
        // A contact that the fields pull apart has no friction.
        let pulls = holds.value < 0.0 && !holds.is_close(ZERO, epsilon);
        let left = (slip - holds).max(Tracked::rounded(1e-4));
        let drag = if sticks || pulls { ZERO } else { (mass * holds / left).max(ZERO) };
        (Self { collider, normal, speed, surface, friction, sticks, drag }, uncertain)
    }

    /// The part of an impulse that is its own, given the directions that it added as the last one.
    pub(super) fn share(
        &self,
        directions: &[TrackedVector],
        impulse: TrackedVector,
    ) -> TrackedVector {
        if self.sticks {
            let along = directions.iter().map(|&d| d.scaled(impulse.dot(d)));
            return along.fold(TrackedVector::ZERO, |sum, part| sum + part);
        }
        let Some(&direction) = directions.first() else { return TrackedVector::ZERO };
        let push = impulse.dot(direction) / self.normal.dot(direction);
        let most = Tracked::exact(2.0) * impulse.dot(self.normal);
        self.normal.scaled(push.min(most).max(ZERO))
    }

    /// What friction does to a particle of this velocity, if it slides.
    pub(super) fn friction_impulse(&self, velocity: TrackedVector) -> TrackedVector {
        let slip = along(velocity - self.surface, self.normal);
        TrackedVector::ZERO - slip.scaled(self.drag)
    }

    /// What a solve says of it, and whether rounding decides.
    pub(super) fn outcome(&self, solved: &Solved, epsilon: f64) -> (Outcome, bool) {
        let push = solved.impulse.dot(self.normal);
        let uncertain = push.is_close(ZERO, epsilon);
        if push.value < 0.0 {
            return (Outcome::Pulls, uncertain);
        }
        let grip = self.friction * push;
        let (outcome, close) = if self.sticks {
            self.outcome_sticking(solved, grip, epsilon)
        } else {
            self.outcome_sliding(solved, grip, epsilon)
        };
        (outcome, uncertain || close)
    }

    fn outcome_sticking(&self, solved: &Solved, grip: Tracked, epsilon: f64) -> (Outcome, bool) {
        let tangential = along(solved.impulse, self.normal);
        let size = tangential.length();
        let uncertain = size.is_close(grip, epsilon);
        if size.value <= grip.value {
            return (Outcome::Stands, uncertain);
        }
        let direction = tangential.divided(size);
        let inertia = direction.dot(solved.inertia.apply(direction));
        (Outcome::Slips(grip * inertia / (size - grip)), uncertain)
    }

    fn outcome_sliding(&self, solved: &Solved, grip: Tracked, epsilon: f64) -> (Outcome, bool) {
        let slip = along(solved.velocity - self.surface, self.normal).length();
        let slip = slip.max(Tracked::rounded(1e-4));
        let drag = grip / slip;
        let error = (drag - self.drag).abs() * slip;
        let [share, smallest] =
            [grip * Tracked::rounded(0.1), solved.mass * Tracked::rounded(3e-4)];
        let uncertain = error.is_close(share.max(smallest), epsilon);
        let corrected = error.value > share.value && error.value > smallest.value;
        (if corrected { Outcome::Corrected(drag) } else { Outcome::Stands }, uncertain)
    }
}

/// What a vector has along the surface with this normal.
fn along(vector: TrackedVector, normal: TrackedVector) -> TrackedVector {
    vector - normal.scaled(vector.dot(normal))
}
