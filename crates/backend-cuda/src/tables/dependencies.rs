//! Which blocks of the frame kernel read particles of which others.

use std::collections::BTreeSet;

use cloth_core::Model;

/// For each block the others that it must wait for. Symmetric, as springs and triangles are.
#[derive(Debug)]
pub(crate) struct Dependencies {
    /// Where the row of each block starts, and the end.
    pub(crate) rows: Vec<u32>,
    pub(crate) blocks: Vec<u32>,
}

impl Dependencies {
    /// For `count` blocks, of which `block_of` says which one a particle is in.
    pub(crate) fn new(model: &Model, count: usize, block_of: impl Fn(usize) -> usize) -> Self {
        let mut sets = vec![BTreeSet::new(); count];
        let mut join = |a: u32, b: u32| {
            let [a, b] = [a, b].map(|particle| block_of(particle as usize));
            if a != b {
                sets[a].insert(b as u32);
                sets[b].insert(a as u32);
            }
        };
        for spring in model.springs().iter() {
            join(spring.particles[0], spring.particles[1]);
        }
        if model.air().is_some() {
            for &[a, b, c] in model.triangles() {
                join(a, b);
                join(b, c);
                join(c, a);
            }
        }
        let mut rows = vec![0];
        let mut blocks = Vec::new();
        for set in sets {
            blocks.extend(set);
            rows.push(blocks.len() as u32);
        }
        Self { rows, blocks }
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder};

    use super::*;

    #[test]
    fn rows_of_a_patch_wait_for_the_rows_beside_them() {
        let geometry = Geometry::Grid(GridPatch::horizontal(10, 0.02, 0.0));
        let material = MaterialPreset::ALL[0].material(0.02);
        let name = "cloth".to_owned();
        let cloth = Cloth { name, geometry, material, pins: vec![], velocity: [0.0; 3] };
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let found = Dependencies::new(&model, 5, |particle| particle / 20);
        assert_eq!(found.rows, [0, 1, 3, 5, 7, 8]);
        assert_eq!(found.blocks, [1, 0, 2, 1, 3, 2, 4, 3]);
    }
}
