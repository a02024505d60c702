//! Pairs that the impulse response leaves out, in the form of `shared/contact_exclusions.wgsl`.

use std::collections::HashMap;

use cloth_core::{InteractionKind, Model, Neighbours, SelfContact};

/// n + 1 offsets, then for each particle its partners, ascending: joined to it by a spring or an edge of a triangle
/// of fabric, or closer than the contact distance at the start. Decided in double precision.
pub(super) fn table(model: &Model, contact: &SelfContact) -> Vec<u32> {
    let count = model.particle_count();
    let mut joined = model.interactions();
    joined.retain(|kind| matches!(kind, InteractionKind::Spring | InteractionKind::Membrane));
    let neighbours = Neighbours::new(&joined);
    let cells = Cells::new(model, contact.distance);
    let mut table = vec![0_u32; count + 1];
    let mut row = Vec::new();
    for particle in 0..count {
        row.clear();
        row.extend_from_slice(neighbours.row(particle));
        cells.near(model, particle, contact.distance, &mut row);
        row.sort_unstable();
        row.dedup();
        table.extend_from_slice(&row);
        table[particle + 1] = table[particle] + row.len() as u32;
    }
    table
}

type Cell = [i64; 3];

/// The particles in cells of the size of the contact distance.
struct Cells(HashMap<Cell, Vec<u32>>);

fn cell_of(position: [f64; 3], size: f64) -> Cell {
    position.map(|component| (component / size).floor() as i64)
}

impl Cells {
    fn new(model: &Model, size: f64) -> Self {
        let mut cells: HashMap<Cell, Vec<u32>> = HashMap::new();
        for (particle, &position) in model.positions().iter().enumerate() {
            cells.entry(cell_of(position, size)).or_default().push(particle as u32);
        }
        Self(cells)
    }

    /// Adds all particles closer than `distance`.
    fn near(&self, model: &Model, particle: usize, distance: f64, row: &mut Vec<u32>) {
        let position = model.positions()[particle];
        let centre = cell_of(position, distance);
        for k in 0..27 {
            let step = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            let cell = std::array::from_fn(|axis| centre[axis].saturating_add(step[axis]));
            let others = self.0.get(&cell).into_iter().flatten();
            row.extend(others.copied().filter(|&other| {
                let other_position = model.positions()[other as usize];
                let squared: f64 =
                    position.iter().zip(&other_position).map(|(a, b)| (a - b) * (a - b)).sum();
                other as usize != particle && squared.sqrt() < distance
            }));
        }
    }
}
