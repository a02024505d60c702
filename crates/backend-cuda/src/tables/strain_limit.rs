//! What is strain limited, by colours: springs and triangles of fabric.

use cloth_core::{ColourRegions, Colouring, Model, SpringColouring, StrainLimit};

use crate::layout::CudaReal;

/// Particles of a region, at least.
const REGION_MIN: usize = 32;

/// The tables of `strain_limit.cu`.
#[derive(Debug)]
pub(crate) struct StrainTables<T> {
    /// Two particles and kind, colours one after the other.
    pub(crate) springs: Vec<[u32; 4]>,
    /// Where each colour starts, and the end.
    pub(crate) colours: Vec<u32>,
    /// Largest length of each kind \[m\].
    pub(crate) longest: Vec<T>,
    /// Numbers of triangles, colours one after the other, and where each colour starts, and the end.
    pub(crate) triangles: Vec<u32>,
    pub(crate) triangle_colours: Vec<u32>,
    /// Largest stretch of triangles.
    pub(crate) ratio: T,
    pub(crate) sweeps: u32,
    colouring: SpringColouring,
}

impl<T: CudaReal> StrainTables<T> {
    pub(crate) fn new(model: &Model, limit: Option<&StrainLimit>) -> Self {
        let mut tables = Self {
            springs: Vec::new(),
            colours: vec![0],
            longest: Vec::new(),
            triangles: Vec::new(),
            triangle_colours: vec![0],
            ratio: T::ZERO,
            sweeps: 0,
            colouring: SpringColouring::default(),
        };
        let Some(limit) = limit else { return tables };
        let springs = model.springs();
        let colouring = SpringColouring::greedy(springs, model.particle_count(), &limit.classes);
        tables.sweeps = limit.sweeps;
        for colour in 0..colouring.len() {
            let entries = colouring.colour(colour).iter().map(|&[i, j, kind]| [i, j, kind, 0]);
            tables.springs.extend(entries);
            tables.colours.push(tables.springs.len() as u32);
        }
        let longest = |kind: &cloth_core::SpringKind| {
            T::from_f64(limit.ratio) * T::from_f64(kind.rest_length)
        };
        tables.longest = springs.kinds().iter().map(longest).collect();
        tables.colouring = colouring;
        tables.ratio = T::from_f64(limit.ratio);
        let of_triangles =
            Colouring::of_triangles(model.elements().triangles(), model.particle_count());
        for colour in 0..of_triangles.len() {
            tables.triangles.extend_from_slice(of_triangles.colour(colour));
            tables.triangle_colours.push(tables.triangles.len() as u32);
        }
        tables
    }

    /// Regions of so many particles that blocks sweep over one at a time, or of fewer if these depend on more than `most`; none if they always do,
    /// or if triangles are limited, which are swept over all at once.
    pub(crate) fn regions(&self, model: &Model, size: usize, most: usize) -> ColourRegions {
        if !self.triangles.is_empty() {
            return ColourRegions::default();
        }
        let count = model.particle_count();
        let sizes = std::iter::successors(Some(size), |&size| {
            (size > REGION_MIN).then(|| (size / 2).next_multiple_of(REGION_MIN))
        });
        let made = sizes.map(|size| {
            let order = model.particle_groups(size);
            ColourRegions::new(&self.colouring, &order, size, most, count)
        });
        made.flatten().next().unwrap_or_default()
    }
}
