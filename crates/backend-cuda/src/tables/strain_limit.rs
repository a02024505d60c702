//! The springs that are strain limited, by colours.

use cloth_core::{Model, SpringColouring, StrainLimit};

use crate::layout::CudaReal;

/// The tables of `strain_limit.cu`.
#[derive(Debug)]
pub(crate) struct StrainTables<T> {
    /// Two particles and kind, colours one after the other.
    pub(crate) springs: Vec<[u32; 4]>,
    /// Where each colour starts, and the end.
    pub(crate) colours: Vec<u32>,
    /// Largest length of each kind \[m\].
    pub(crate) longest: Vec<T>,
}

impl<T: CudaReal> StrainTables<T> {
    pub(crate) fn new(model: &Model, limit: Option<&StrainLimit>) -> Self {
        let mut tables = Self { springs: Vec::new(), colours: vec![0], longest: Vec::new() };
        let Some(limit) = limit else { return tables };
        let springs = model.springs();
        let colouring = SpringColouring::greedy(springs, model.particle_count(), &limit.classes);
        for colour in 0..colouring.len() {
            let entries = colouring.colour(colour).iter().map(|&[i, j, kind]| [i, j, kind, 0]);
            tables.springs.extend(entries);
            tables.colours.push(tables.springs.len() as u32);
        }
        let longest = |kind: &cloth_core::SpringKind| {
            T::from_f64(limit.ratio) * T::from_f64(kind.rest_length)
        };
        tables.longest = springs.kinds().iter().map(longest).collect();
        tables
    }
}
