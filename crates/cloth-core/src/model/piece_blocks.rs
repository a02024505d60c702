//! Connected pieces of cloth that nothing holds, in blocks, for sums over them in a fixed order.

use super::NONE;

/// Particles of a block, the unit of the sums.
const BLOCK: usize = 4096;

/// The pieces without held particles, as tables that a GPU reads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PieceBlocks {
    /// First block of each piece, and the one after its last.
    pub rows: Vec<[u32; 2]>,
    /// For each block its piece, its first place in [`Self::particles`], the one after its last, and 0.
    pub blocks: Vec<[u32; 4]>,
    /// Particles of all blocks.
    pub particles: Vec<u32>,
    /// The piece of each particle, or [`NONE`].
    pub piece_of: Vec<u32>,
}

impl PieceBlocks {
    /// Those of `pieces` ([`Model::connected_pieces`](crate::Model::connected_pieces)) that have no held particle;
    /// `held` says of every particle whether it is held.
    ///
    /// # Panics
    /// If a piece has a particle beyond the end of `held`.
    #[must_use]
    pub fn new(pieces: &[Vec<u32>], held: &[bool]) -> Self {
        let mut tables = Self { piece_of: vec![NONE; held.len()], ..Self::default() };
        let is_free = |piece: &&Vec<u32>| !piece.iter().any(|&particle| held[particle as usize]);
        for (number, piece) in pieces.iter().filter(is_free).enumerate() {
            let first = tables.blocks.len() as u32;
            for block in piece.chunks(BLOCK) {
                let start = tables.particles.len() as u32;
                tables.particles.extend_from_slice(block);
                tables.blocks.push([number as u32, start, tables.particles.len() as u32, 0]);
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
    use super::*;

    #[test]
    fn held_pieces_are_left_out() {
        let pieces = [(0..9).collect::<Vec<_>>(), (9..9 + 4900).collect()];
        let mut held = vec![false; 9 + 4901];
        let free = PieceBlocks::new(&pieces, &held);
        assert_eq!(free.rows, [[0, 1], [1, 3]]);
        assert_eq!(free.blocks[2], [1, 9 + 4096, 9 + 4900, 0]);
        assert_eq!((free.piece_of[8], free.piece_of[9], free.piece_of[9 + 4900]), (0, 1, NONE));
        held[4] = true;
        let rest = PieceBlocks::new(&pieces, &held);
        assert_eq!((rest.rows.len(), rest.piece_of[4], rest.piece_of[9]), (1, NONE, 0));
    }
}
