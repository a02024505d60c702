//! NUMERICS §5, `constraint_release`.

use cloth_core::Model;

use super::{
    Constraint, Constraints, LinearSystem,
    touch::{Outcome, Solved},
};
use crate::{Number, Particles, Vector};

/// Releases contacts that pull, lets those slide that slip, and corrects the drag of those that slide, given a solution of the
/// system. Returns the number of particles whose contacts changed.
pub fn constraint_release<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    constraints: &mut Constraints<N>,
    system: &mut LinearSystem<N>,
    solution: &[Vector<N>],
) -> u64 {
    let (image, blocks) = (system.apply(solution), system.diagonal());
    let mut released = 0;
    for (i, constraint) in constraints.0.iter_mut().enumerate() {
        let velocity = particles.velocities[i];
        let solved = Solved {
            impulse: image[i] - system.right_side[i],
            velocity: velocity + solution[i],
            mass: N::rounded(model.masses()[i]),
            inertia: blocks[i],
        };
        let before = constraint.clone();
        let (changed, uncertain) = constraint.release(&solved, particles.epsilon);
        particles.uncertain[i] |= uncertain;
        if changed {
            before.add_drags(i, velocity, -1.0, system);
            constraint.add_drags(i, velocity, 1.0, system);
            released += 1;
        }
    }
    released
}

impl<N: Number> Constraint<N> {
    /// What a solve makes of the contacts: whether anything changed, and whether rounding decides.
    fn release(&mut self, solved: &Solved<N>, epsilon: f64) -> (bool, bool) {
        let [mut changed, mut uncertain] = [false; 2];
        for index in (0..self.touches.len()).rev() {
            let touch = &mut self.touches[index];
            let (outcome, close) = touch.outcome(solved, epsilon);
            uncertain |= close;
            match outcome {
                Outcome::Stands => continue,
                Outcome::Corrected(drag) => {
                    touch.drag = drag;
                    changed = true;
                    continue;
                }
                Outcome::Slips(drag) => {
                    touch.sticks = false;
                    touch.drag = drag;
                }
                Outcome::Pulls => {
                    self.touches.remove(index);
                }
            }
            uncertain |= self.update(epsilon);
            return (true, uncertain);
        }
        (changed, uncertain)
    }
}
