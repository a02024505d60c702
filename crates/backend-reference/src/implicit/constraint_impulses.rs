//! NUMERICS §5, `constraint_impulses`.

use super::{Constraint, Constraints, LinearSystem};
use crate::{Impulse, Number, Particles, Vector};

/// Adds what the constraints did to particles with the velocities of the end of a substep to the sums of each collider. Without a
/// solution it is zero.
pub fn constraint_impulses<N: Number>(
    particles: &Particles<N>,
    constraints: &Constraints<N>,
    system: &LinearSystem<N>,
    solution: Option<&[Vector<N>]>,
    sums: &mut [Impulse<N>],
) {
    let image = solution.map(|solution| system.apply(solution));
    for (i, constraint) in constraints.0.iter().enumerate() {
        let image = image.as_ref().map_or(Vector::ZERO, |image| image[i]);
        let (excess, velocity) = (image - system.right_side[i], particles.velocities[i]);
        for (collider, impulse) in constraint.impulses(excess, velocity, particles.epsilon) {
            sums[collider][0] += impulse;
            sums[collider][1] += particles.positions[i].cross(impulse);
        }
    }
}

impl<N: Number> Constraint<N> {
    /// What each of its contacts does, from A y - b and the velocity at the end: the number of the
    /// collider and the impulse.
    fn impulses(
        &self,
        excess: Vector<N>,
        velocity: Vector<N>,
        epsilon: f64,
    ) -> Vec<(usize, Vector<N>)> {
        // How many directions there are with the first contacts alone.
        let mut counts = vec![0];
        let mut first = Self::default();
        for &touch in &self.touches {
            first.touches.push(touch);
            first.update(epsilon);
            counts.push(first.directions.len());
        }
        let mut rest = excess;
        let mut impulses = Vec::new();
        for (index, touch) in self.touches.iter().enumerate().rev() {
            let own = &self.directions[counts[index]..counts[index + 1]];
            let share = if index == 0 { rest } else { touch.share(own, rest) };
            rest -= share;
            impulses.push((touch.collider, share + touch.friction_impulse(velocity)));
        }
        impulses
    }
}
