//! States far from the rest shape.

use cloth_core::{Model, State};

use super::description::Deformation;
use crate::random::Random;

/// Lays the half of all particles with x above `x_fold` \[m\] back over the other half, `gap` \[m\]
/// higher.
pub fn fold(state: &mut State, x_fold: f64, gap: f64) {
    for position in &mut state.positions {
        if position[0] > x_fold {
            position[0] = 2.0 * x_fold - position[0];
            position[2] += gap;
        }
    }
}

fn centre(positions: &[[f64; 3]]) -> [f64; 3] {
    let sum =
        positions.iter().fold([0.0; 3], |sum: [f64; 3], x| std::array::from_fn(|k| sum[k] + x[k]));
    sum.map(|component| component / positions.len() as f64)
}

/// The initial state, deformed; velocities changed at random.
pub(super) fn deformed(
    model: &Model,
    deformation: Deformation,
    spacing: f64,
    random: &mut Random,
) -> State {
    let mut state = model.initial_state();
    let centre = centre(&state.positions);
    let scale = match deformation {
        Deformation::Stretched => random.between(1.3, 1.7),
        Deformation::Compressed => random.between(0.4, 0.7),
        Deformation::Jitter | Deformation::Folded | Deformation::Coinciding => 1.0,
    };
    for position in &mut state.positions {
        *position = std::array::from_fn(|k| centre[k] + scale * (position[k] - centre[k]));
    }
    if matches!(deformation, Deformation::Folded) {
        fold(&mut state, centre[0], 0.5 * spacing);
    }
    for vector in &mut state.positions {
        let jitter = random.vector(0.3 * spacing);
        *vector = std::array::from_fn(|k| vector[k] + jitter[k]);
    }
    if matches!(deformation, Deformation::Coinciding) {
        coincide(&mut state.positions, random);
    }
    for velocity in &mut state.velocities {
        let change = random.vector(2.0);
        *velocity = std::array::from_fn(|k| velocity[k] + change[k]);
    }
    state
}

/// Puts every fifth particle where a random other one is, exactly or almost.
fn coincide(positions: &mut [[f64; 3]], random: &mut Random) {
    for i in (0..positions.len()).step_by(5) {
        let other = positions[random.index(positions.len())];
        let offset = if random.chance(0.5) { 0.0 } else { random.logarithmic(1e-9, 1e-3) };
        let direction = random.direction();
        positions[i] = std::array::from_fn(|k| other[k] + offset * direction[k]);
    }
}
