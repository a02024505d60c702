//! Comparing states bit by bit.

use cloth_core::State;

/// The bits of all positions and velocities.
#[must_use]
pub fn bits(state: &State) -> Vec<[u64; 3]> {
    let vectors = state.positions.iter().chain(&state.velocities);
    vectors.map(|vector| vector.map(f64::to_bits)).collect()
}

/// The first particle whose position or velocity differs in a bit.
#[must_use]
pub fn first_difference(a: &State, b: &State) -> Option<usize> {
    let [a, b] = [bits(a), bits(b)];
    assert_eq!(a.len(), b.len());
    let particles = a.len() / 2;
    a.iter().zip(&b).position(|(a, b)| a != b).map(|index| index % particles)
}
