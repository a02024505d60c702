//! The folds that patches have in common: each is computed once (NUMERICS §12).

use std::collections::HashMap;

use cloth_core::{
    Real,
    fabric::{
        bending::{FOLD_PLACES, PATCH},
        hinge::{self, Fold},
    },
};
use rayon::prelude::*;

use super::TASK;
use crate::memory::Motion;

/// The folds of all patches. Up to six of them have the same one, in two orders of its vertices, which differ in rounding.
#[derive(Debug)]
pub(super) struct FoldTable<T> {
    vertices: Vec<[u32; 4]>,
    /// Of each patch.
    numbers: Vec<[u32; FOLD_PLACES.len()]>,
    folds: Vec<Fold<T>>,
}

impl<T: Real> FoldTable<T> {
    pub(super) fn new(patches: &[[u32; PATCH]]) -> Self {
        let mut vertices = Vec::new();
        let mut known = HashMap::new();
        let numbers = patches.iter().map(|patch| {
            FOLD_PLACES.map(|places| {
                let fold = places.map(|place| patch[place]);
                *known.entry(fold).or_insert_with(|| {
                    vertices.push(fold);
                    vertices.len() as u32 - 1
                })
            })
        });
        Self { numbers: numbers.collect(), vertices, folds: Vec::new() }
    }

    /// Computes them at the present positions.
    pub(super) fn compute(&mut self, motion: &Motion<T>) {
        let folds = self.vertices.par_iter().with_min_len(TASK).map(|vertices| {
            hinge::fold(vertices.map(|vertex| motion.position.get(vertex as usize)))
        });
        folds.collect_into_vec(&mut self.folds);
    }

    /// Those of each patch, in the order of [`FOLD_PLACES`].
    pub(super) fn of_patches(
        &self,
    ) -> impl IndexedParallelIterator<Item = [Fold<T>; FOLD_PLACES.len()]> {
        self.numbers.par_iter().map(|numbers| numbers.map(|number| self.folds[number as usize]))
    }
}
