//! Contents of `shared/contact_table.wgsl`.

use cloth_core::{
    NewtonStart,
    contact::{ContactEquation, ContactSet},
};

/// Words before the rows of particles.
pub(crate) const TABLE_HEAD: usize = 2;
/// Words of a contact.
const CONTACT_WORDS: usize = 4 + 4 + 6 + 3 + 3;

/// The table of the present contacts of `count` particles.
pub(crate) fn table(
    set: &ContactSet<f32>,
    equations: &[ContactEquation<f32>],
    count: usize,
    start: NewtonStart,
) -> Vec<u32> {
    let (offsets, places) = set.rows();
    // Behind those of particles come those of nodes of bodies.
    let offsets = &offsets[..=count];
    let places = &places[..offsets[count] as usize];
    let first = (TABLE_HEAD + count + 1) as u32;
    let end = first + places.len() as u32;
    let mut words = Vec::with_capacity(end as usize + CONTACT_WORDS * equations.len());
    words.extend([end, u32::from(start == NewtonStart::StepStart)]);
    words.extend(offsets.iter().map(|offset| first + offset));
    words.extend_from_slice(places);
    for (equation, state) in equations.iter().zip(set.states()) {
        words.extend(equation.particles);
        let numbers = equation.weights.iter().chain(&state.action.rows);
        let numbers = numbers.chain(&state.action.force).chain(&equation.carried);
        words.extend(numbers.map(|number| number.to_bits()));
    }
    words
}
