//! Contents of `shared/contact_table.wgsl`.

use cloth_core::{
    NewtonStart,
    contact::{ContactEquation, ContactSet},
};
use rayon::prelude::*;

/// Words before the rows of particles.
pub(crate) const TABLE_HEAD: usize = 3;
/// Contacts that a thread of the host puts in words, at least.
const TASK: usize = 256;
/// Where the ranks of a contact are among its words.
const RANKS: usize = 4 + 4 + 6 + 3 + 3;
/// Words of a contact.
const CONTACT_WORDS: usize = RANKS + 4;

/// Puts the table of the present contacts of `count` particles in `words`.
pub(crate) fn table(
    set: &ContactSet<f32>,
    equation: impl Fn(usize) -> ContactEquation<f32> + Sync,
    (count, start): (usize, NewtonStart),
    words: &mut Vec<u32>,
) {
    let (offsets, places) = set.rows();
    // Behind those of particles come those of nodes of bodies.
    let offsets = &offsets[..=count];
    let places = &places[..offsets[count] as usize];
    let first = (TABLE_HEAD + count + 1) as u32;
    let end = first + places.len() as u32;
    words.clear();
    let contacts = set.states().len();
    words.extend([end, u32::from(start == NewtonStart::StepStart), contacts as u32]);
    words.extend(offsets.iter().map(|offset| first + offset));
    words.extend_from_slice(places);
    words.resize(end as usize + CONTACT_WORDS * contacts, 0);
    let all = words[end as usize..].par_chunks_exact_mut(CONTACT_WORDS);
    all.zip(set.states()).enumerate().with_min_len(TASK).for_each(|(contact, (words, state))| {
        let ContactEquation { particles, weights, carried } = equation(contact);
        words[..4].copy_from_slice(&particles);
        let numbers = weights.iter().chain(&state.action.rows);
        let numbers = numbers.chain(&state.action.force).chain(&carried);
        words[4..].iter_mut().zip(numbers).for_each(|(word, number)| *word = number.to_bits());
    });
    let all = &mut words[end as usize..];
    for (rank, place) in places.iter().map(|&place| place as usize).enumerate() {
        all[CONTACT_WORDS * (place / 4) + RANKS + place % 4] = rank as u32;
    }
}
