//! Distance grids of colliders, as kernels read them.

use cloth_core::{ColliderShape, Model};

/// Words of a grid before its samples (`GRID_WORDS` in `shared/distance_grid.wgsl`).
const GRID_WORDS: usize = 12;

/// The words of all grids of a model, in the order of its colliders: for each what describes it, then the
/// samples of all.
pub(crate) fn distance_grids(model: &Model) -> Vec<u32> {
    let grids: Vec<_> = model
        .colliders()
        .iter()
        .filter_map(|collider| match &collider.shape {
            ColliderShape::Grid(grid) => Some(grid),
            _ => None,
        })
        .collect();
    let bits = |number: f64| (number as f32).to_bits();
    let mut words = Vec::new();
    let mut first = GRID_WORDS * grids.len();
    for grid in &grids {
        words.extend(grid.origin.map(bits));
        words.extend([bits(grid.spacing), bits(grid.spacing.recip())]);
        words.extend(grid.size);
        words.push(first as u32);
        words.extend([grid.set_count() as u32, bits(grid.rate)]);
        words.resize(words.len().next_multiple_of(GRID_WORDS), 0);
        first += grid.distances.len();
    }
    for grid in &grids {
        words.extend(grid.distances.iter().map(|distance| distance.to_bits()));
    }
    words
}

/// For each collider the number of its grid among the grids, 0 for another shape.
pub(crate) fn grid_numbers(model: &Model) -> Vec<f32> {
    let mut next = 0.0;
    let number = |collider: &cloth_core::Collider| {
        let number = next;
        match collider.shape {
            ColliderShape::Grid(_) => {
                next += 1.0;
                number
            }
            _ => 0.0,
        }
    };
    model.colliders().iter().map(number).collect()
}
