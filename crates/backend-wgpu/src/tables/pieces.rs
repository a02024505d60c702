//! Connected pieces of cloth, for what conserves angular momentum (`shared/piece.wgsl`).

/// Particles of a block, the unit of the sums.
const BLOCK: usize = 4096;
/// No piece.
const NONE: u32 = u32::MAX;

/// Contents of the buffers of the pieces that nothing holds.
#[derive(Debug, Default)]
pub(crate) struct PieceTables {
    pub(crate) rows: Vec<[u32; 2]>,
    pub(crate) blocks: Vec<[u32; 4]>,
    pub(crate) particles: Vec<u32>,
    pub(crate) piece_of: Vec<u32>,
}

impl PieceTables {
    /// Those of `pieces` that have no held particle.
    pub(crate) fn new(pieces: &[Vec<u32>], held: &[bool]) -> Self {
        let mut tables = Self { piece_of: vec![NONE; held.len()], ..Self::default() };
        let is_free = |piece: &&Vec<u32>| !piece.iter().any(|&particle| held[particle as usize]);
        for (number, piece) in pieces.iter().filter(is_free).enumerate() {
            let first = tables.blocks.len() as u32;
            for block in piece.chunks(BLOCK) {
                let start = tables.particles.len();
                tables.particles.extend_from_slice(block);
                let [start, end] = [start, tables.particles.len()].map(|place| place as u32);
                tables.blocks.push([number as u32, start, end, 0]);
            }
            tables.rows.push([first, tables.blocks.len() as u32]);
            for &particle in piece {
                tables.piece_of[particle as usize] = number as u32;
            }
        }
        tables
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder};

    use super::*;

    #[test]
    fn pieces_are_the_cloths_and_held_ones_are_left_out() {
        let cloth = |name: &str, side| {
            let geometry = Geometry::Grid(GridPatch::horizontal(side, 0.02, 0.0));
            let material = MaterialPreset::ALL[0].material(0.02);
            Cloth { name: name.into(), geometry, material, pins: vec![], velocity: [0.0; 3] }
        };
        let builder = ModelBuilder::new().cloth(cloth("a", 3)).cloth(cloth("b", 70));
        let model = builder.build().unwrap();
        let pieces = model.connected_pieces();
        assert_eq!(pieces, [(0..9).collect::<Vec<_>>(), (9..9 + 4900).collect()]);
        let mut held = vec![false; model.particle_count()];
        let free = PieceTables::new(&pieces, &held);
        assert_eq!(free.rows, [[0, 1], [1, 3]]);
        assert_eq!(free.blocks[2], [1, 9 + 4096, 9 + 4900, 0]);
        held[4] = true;
        let rest = PieceTables::new(&pieces, &held);
        assert_eq!((rest.rows.len(), rest.piece_of[4], rest.piece_of[9]), (1, NONE, 0));
    }
}
