//! NUMERICS §5: one contact of a particle with a collider, and what a solve says of it.

use crate::{Matrix, Number, Vector};

/// Contact with one collider.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch<N> {
    /// Number of the collider.
    pub(super) collider: usize,
    pub(super) normal: Vector<N>,
    /// Velocity along the normal that is asked for.
    pub(super) speed: N,
    /// Velocity of the collider.
    pub(super) surface: Vector<N>,
    friction: N,
    pub(super) sticks: bool,
    /// c, zero while it sticks.
    pub(super) drag: N,
}

/// A particle after a solve.
pub(super) struct Solved<N> {
    /// lambda
    pub(super) impulse: Vector<N>,
    /// v'
    pub(super) velocity: Vector<N>,
    pub(super) mass: N,
    /// D
    pub(super) inertia: Matrix<N>,
}

/// What becomes of a contact.
pub(super) enum Outcome<N> {
    Stands,
    /// It slides on with this drag.
    Corrected(N),
    /// It begins to slide with this drag.
    Slips(N),
    Pulls,
}

impl<N: Number> Touch<N> {
    /// The contact of a particle with the collider of this number that lets it come as near as `largest`, its
    /// velocity along the normal, and whether rounding decides what it is like.
    pub(super) fn new(
        (collider, normal, largest): (usize, Vector<N>, N),
        mass: N,
        [velocity, predicted, surface]: [Vector<N>; 3],
        [restitution, friction]: [N; 2],
        epsilon: f64,
    ) -> (Self, bool) {
        let carried = surface.dot(normal);
        let approach = (velocity - surface).dot(normal);
        let mut speed = largest.min(carried);
        let mut uncertain = false;
        if restitution.value() > 0.0 {
            uncertain = approach.is_close(N::ZERO, epsilon);
            if approach.value() < 0.0 {
                speed = speed.max(carried - restitution * approach);
            }
        }
        let slip = (predicted - surface).along_plane(normal).length();
        let holds = friction * (speed - predicted.dot(normal));
        uncertain |= slip.is_close(holds, epsilon);
        let sticks = slip.value() <= holds.value();
        // A contact that the fields pull apart has no friction.
        let pulls = holds.value() < 0.0 && !holds.is_close(N::ZERO, epsilon);
        let left = (slip - holds).max(N::rounded(1e-4));
        let drag = if sticks || pulls { N::ZERO } else { (mass * holds / left).max(N::ZERO) };
        (Self { collider, normal, speed, surface, friction, sticks, drag }, uncertain)
    }

    /// The part of an impulse that is its own, given the directions that it added as the last one.
    pub(super) fn share(&self, directions: &[Vector<N>], impulse: Vector<N>) -> Vector<N> {
        if self.sticks {
            let along = directions.iter().map(|&d| d.scaled(impulse.dot(d)));
            return along.fold(Vector::ZERO, |sum, part| sum + part);
        }
        let Some(&direction) = directions.first() else { return Vector::ZERO };
        let push = impulse.dot(direction) / self.normal.dot(direction);
        let most = N::exact(2.0) * impulse.dot(self.normal);
        self.normal.scaled(push.min(most).max(N::ZERO))
    }

    /// What friction does to a particle of this velocity, if it slides.
    pub(super) fn friction_impulse(&self, velocity: Vector<N>) -> Vector<N> {
        let slip = (velocity - self.surface).along_plane(self.normal);
        Vector::ZERO - slip.scaled(self.drag)
    }

    /// What a solve says of it, and whether rounding decides.
    pub(super) fn outcome(&self, solved: &Solved<N>, epsilon: f64) -> (Outcome<N>, bool) {
        let push = solved.impulse.dot(self.normal);
        let uncertain = push.is_close(N::ZERO, epsilon);
        if push.value() < 0.0 {
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

    fn outcome_sticking(&self, solved: &Solved<N>, grip: N, epsilon: f64) -> (Outcome<N>, bool) {
        let tangential = solved.impulse.along_plane(self.normal);
        let size = tangential.length();
        let uncertain = size.is_close(grip, epsilon);
        if size.value() <= grip.value() {
            return (Outcome::Stands, uncertain);
        }
        let direction = tangential.divided(size);
        let inertia = direction.dot(solved.inertia.apply(direction));
        (Outcome::Slips(grip * inertia / (size - grip)), uncertain)
    }

    fn outcome_sliding(&self, solved: &Solved<N>, grip: N, epsilon: f64) -> (Outcome<N>, bool) {
        let slip = (solved.velocity - self.surface).along_plane(self.normal).length();
        let slip = slip.max(N::rounded(1e-4));
        let drag = grip / slip;
        let error = (drag - self.drag).abs() * slip;
        let [share, smallest] = [grip * N::rounded(0.1), solved.mass * N::rounded(3e-4)];
        let uncertain = error.is_close(share.max(smallest), epsilon);
        let corrected = error.value() > share.value() && error.value() > smallest.value();
        (if corrected { Outcome::Corrected(drag) } else { Outcome::Stands }, uncertain)
    }
}
