//! What is strain limited, by colours: springs and triangles of fabric.

use cloth_core::{Colouring, Model, SpringColouring, StrainLimit};

use crate::layout::Colour;

/// The tables of `strain_limit.wgsl` and `stretch_limit.wgsl`.
#[derive(Debug, Default)]
pub(crate) struct StrainTables {
    /// The colours of springs, then those of triangles.
    pub(crate) colours: Vec<Colour>,
    pub(crate) spring_colours: usize,
    /// Two particles and the largest length \[m\] of each spring.
    pub(crate) springs: Vec<[u32; 4]>,
    /// Numbers of triangles.
    pub(crate) triangles: Vec<u32>,
}

impl StrainTables {
    pub(super) fn new(model: &Model, limit: Option<&StrainLimit>) -> Self {
        let mut tables = Self::default();
        let Some(limit) = limit else { return tables };
        let ratio = limit.ratio as f32;
        let colour = |first: usize, count: usize| Colour {
            first: first as u32,
            count: count as u32,
            ratio,
            padding_0: 0,
        };
        let springs = model.springs();
        let colouring = SpringColouring::greedy(springs, model.particle_count(), &limit.classes);
        for group in (0..colouring.len()).map(|number| colouring.colour(number)) {
            tables.colours.push(colour(tables.springs.len(), group.len()));
            tables.springs.extend(group.iter().map(|&[i, j, kind]| {
                let rest_length = springs.kinds()[kind as usize].rest_length as f32;
                [i, j, (ratio * rest_length).to_bits(), 0]
            }));
        }
        tables.spring_colours = colouring.len();
        let triangles = model.elements().triangles();
        let colouring = Colouring::of_triangles(triangles, model.particle_count());
        for group in (0..colouring.len()).map(|number| colouring.colour(number)) {
            tables.colours.push(colour(tables.triangles.len(), group.len()));
            tables.triangles.extend_from_slice(group);
        }
        tables
    }
}
