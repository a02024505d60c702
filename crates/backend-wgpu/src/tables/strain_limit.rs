//! The springs that are strain limited, by colours.

use cloth_core::{Model, SpringColouring, StrainLimit};

use crate::layout::Colour;

/// The colours, and the springs in the form of `strain_limit.wgsl`.
pub(super) fn tables(model: &Model, limit: Option<&StrainLimit>) -> (Vec<Colour>, Vec<[u32; 4]>) {
    let Some(limit) = limit else { return (Vec::new(), Vec::new()) };
    let springs = model.springs();
    let colouring = SpringColouring::greedy(springs, model.particle_count(), &limit.classes);
    let mut colours = Vec::with_capacity(colouring.len());
    let mut limited = Vec::new();
    for colour in 0..colouring.len() {
        let group = colouring.colour(colour);
        let first = limited.len() as u32;
        colours.push(Colour { first, count: group.len() as u32, ..Colour::default() });
        limited.extend(group.iter().map(|&[i, j, kind]| {
            let rest_length = springs.kinds()[kind as usize].rest_length as f32;
            [i, j, (limit.ratio as f32 * rest_length).to_bits(), 0]
        }));
    }
    (colours, limited)
}
