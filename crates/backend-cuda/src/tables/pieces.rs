//! Connected pieces of cloth that nothing holds, for what conserves angular momentum (`torque_correct.cu`).

/// Particles of a block, the unit of the sums.
const BLOCK: usize = 4096;
/// No piece.
const NONE: u32 = u32::MAX;

/// The free ones of all pieces.
#[derive(Debug, Default)]
pub(crate) struct PieceTables {
    /// First block of each piece, and the one after the last.
    pub(crate) rows: Vec<[u32; 2]>,
    /// Piece, first of its particles in `particles`, and the one after the last.
    pub(crate) blocks: Vec<[u32; 4]>,
    pub(crate) particles: Vec<u32>,
    /// The piece of each particle.
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
        let free = PieceTables::new(&pieces, &held);
        assert_eq!(free.rows, [[0, 1], [1, 3]]);
        assert_eq!(free.blocks[2], [1, 9 + 4096, 9 + 4900, 0]);
        assert_eq!((free.piece_of[8], free.piece_of[9], free.piece_of[9 + 4900]), (0, 1, NONE));
        held[4] = true;
        let rest = PieceTables::new(&pieces, &held);
        assert_eq!((rest.rows.len(), rest.piece_of[4], rest.piece_of[9]), (1, NONE, 0));
    }
}
