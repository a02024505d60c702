//! Contents of `shared/contact_table.wgsl`.

use cloth_core::{
    NewtonStart,
    contact::{ContactEquation, ContactSet},
};

/// Words before the rows of particles.
pub(crate) const TABLE_HEAD: usize = 2;
/// Words of a contact.
const CONTACT_WORDS: usize = 4 + 4 + 6 + 3 + 3;

/// The particles of a contact, with their place in it and their weight.
fn ends(particles: [u32; 4], weights: [f32; 4]) -> impl Iterator<Item = (usize, usize, f32)> {
    let ends = particles.into_iter().zip(weights).enumerate();
    ends.map(|(place, (particle, weight))| (place, particle as usize, weight))
        .filter(|(_, _, weight)| *weight != 0.0)
}

/// The table of the present contacts of `count` particles.
pub(crate) fn table(
    set: &ContactSet<f32>,
    equations: &[ContactEquation<f32>],
    count: usize,
    start: NewtonStart,
) -> Vec<u32> {
    let ends = |equation: &ContactEquation<f32>| ends(equation.particles, equation.weights);
    let first = TABLE_HEAD + count + 1;
    let mut words = vec![0_u32; first];
    // Each row begins where the one before ends: counts first.
    for (_, particle, _) in equations.iter().flat_map(ends) {
        words[TABLE_HEAD + particle + 1] += 1;
    }
    words[TABLE_HEAD] = first as u32;
    for at in TABLE_HEAD + 1..first {
        words[at] += words[at - 1];
    }
    let end = words[first - 1];
    words.resize(end as usize, 0);
    let mut next = words[TABLE_HEAD..first].to_vec();
    for (contact, equation) in equations.iter().enumerate() {
        for (place, particle, _) in ends(equation) {
            words[next[particle] as usize] = (4 * contact + place) as u32;
            next[particle] += 1;
        }
    }
    words[0] = end;
    words[1] = u32::from(start == NewtonStart::StepStart);
    words.reserve(CONTACT_WORDS * equations.len());
    for (equation, state) in equations.iter().zip(set.states()) {
        words.extend(equation.particles);
        let numbers = equation.weights.iter().chain(&state.action.rows);
        let numbers = numbers.chain(&state.action.force).chain(&equation.carried);
        words.extend(numbers.map(|number| number.to_bits()));
    }
    words
}
