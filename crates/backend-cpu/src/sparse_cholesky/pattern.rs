//! Which entries of a symmetric matrix can differ from zero.

/// Neighbours of every particle, ascending, as compressed sparse rows.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhood {
    offsets: Vec<usize>,
    columns: Vec<u32>,
}

impl Neighbourhood {
    /// From pairs of different particles in any order; the same pair may come twice.
    pub(crate) fn new(count: usize, pairs: &[[u32; 2]]) -> Self {
        let mut offsets = vec![0; count + 1];
        for &[a, b] in pairs {
            offsets[a as usize + 1] += 1;
            offsets[b as usize + 1] += 1;
        }
        for i in 0..count {
            offsets[i + 1] += offsets[i];
        }
        let mut columns = vec![0; offsets[count]];
        let mut next = offsets.clone();
        for &[a, b] in pairs {
            for (row, column) in [(a, b), (b, a)] {
                columns[next[row as usize]] = column;
                next[row as usize] += 1;
            }
        }
        let mut length = 0;
        let mut start = 0;
        for row in 0..count {
            let end = offsets[row + 1];
            columns[start..end].sort_unstable();
            offsets[row] = length;
            for entry in start..end {
                if entry == start || columns[entry] != columns[entry - 1] {
                    columns[length] = columns[entry];
                    length += 1;
                }
            }
            start = end;
        }
        offsets[count] = length;
        columns.truncate(length);
        Self { offsets, columns }
    }

    pub(crate) fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Neighbours of a particle.
    pub(crate) fn of(&self, particle: usize) -> &[u32] {
        &self.columns[self.offsets[particle]..self.offsets[particle + 1]]
    }

    /// Neighbours of larger index.
    pub(crate) fn after(&self, particle: usize) -> &[u32] {
        let neighbours = self.of(particle);
        &neighbours[neighbours.partition_point(|&other| (other as usize) < particle)..]
    }

    /// The connected pieces, in the order of their first particles, each ascending.
    pub(crate) fn pieces(&self) -> Vec<Vec<u32>> {
        let mut is_reached = vec![false; self.len()];
        let mut pieces = Vec::new();
        for start in 0..self.len() {
            if is_reached[start] {
                continue;
            }
            is_reached[start] = true;
            let mut piece = vec![start as u32];
            let mut next = 0;
            while let Some(&particle) = piece.get(next) {
                next += 1;
                for &other in self.of(particle as usize) {
                    if !std::mem::replace(&mut is_reached[other as usize], true) {
                        piece.push(other);
                    }
                }
            }
            piece.sort_unstable();
            pieces.push(piece);
        }
        pieces
    }
}

/// Lower triangle by columns: the diagonal entry first, then rows ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LowerPattern {
    pub(crate) offsets: Vec<usize>,
    pub(crate) rows: Vec<usize>,
}

impl LowerPattern {
    /// The matrix of one number for each particle and each pair of neighbours.
    pub(crate) fn of_particles(neighbourhood: &Neighbourhood) -> Self {
        Self::of_blocks(neighbourhood, 1)
    }

    /// The matrix of `size` x `size` numbers for each; rows and columns of a particle are together.
    pub(crate) fn of_blocks(neighbourhood: &Neighbourhood, size: usize) -> Self {
        let mut pattern = Self { offsets: vec![0], rows: Vec::new() };
        for particle in 0..neighbourhood.len() {
            for column in 0..size {
                pattern.rows.extend((column..size).map(|row| size * particle + row));
                for &other in neighbourhood.after(particle) {
                    pattern.rows.extend((0..size).map(|row| size * other as usize + row));
                }
                pattern.offsets.push(pattern.rows.len());
            }
        }
        pattern
    }

    pub(crate) fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Where the entry of a column and a later row is.
    pub(crate) fn place(&self, column: usize, row: usize) -> usize {
        let first = self.offsets[column];
        first + self.rows[first..self.offsets[column + 1]].partition_point(|&at| at < row)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Positions and pairs of a square patch in which every particle is joined to the 5 x 5 block
    /// around it.
    pub(crate) fn grid_springs(side: u32) -> (Vec<[f64; 3]>, Vec<[u32; 2]>) {
        let mut positions = Vec::new();
        let mut pairs = Vec::new();
        for j in 0..side {
            for i in 0..side {
                positions.push([f64::from(i), f64::from(j), 0.0]);
                for (di, dj) in (0..=2_u32).flat_map(|dj| (0..=4_u32).map(move |di| (di, dj))) {
                    let (a, b) = (i + di, j + dj);
                    if (dj > 0 || di > 2) && (2..side + 2).contains(&a) && b < side {
                        pairs.push([j * side + i, b * side + a - 2]);
                    }
                }
            }
        }
        (positions, pairs)
    }

    #[test]
    fn neighbours_are_sorted_and_counted_once() {
        let neighbourhood = Neighbourhood::new(6, &[[2, 0], [0, 1], [1, 0], [4, 2]]);
        assert_eq!(neighbourhood.of(0), [1, 2]);
        assert_eq!(neighbourhood.of(2), [0, 4]);
        assert_eq!(neighbourhood.pieces(), [vec![0, 1, 2, 4], vec![3], vec![5]]);
        let pattern = LowerPattern::of_particles(&neighbourhood);
        assert_eq!(pattern.offsets, [0, 3, 4, 6, 7, 8, 9]);
        assert_eq!(pattern.rows, [0, 1, 2, 1, 2, 4, 3, 4, 5]);
        let blocks = LowerPattern::of_blocks(&neighbourhood, 2);
        assert_eq!(blocks.rows[..11], [0, 1, 2, 3, 4, 5, 1, 2, 3, 4, 5]);
    }
}
