//! The springs of a model as a symmetric sparse matrix (NUMERICS §1).

use std::{collections::HashMap, ops::Range};

/// What a spring is for. Stiffness and damping are set per class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SpringClass {
    /// Along the threads, or along the edges of a triangle mesh.
    Stretch,
    /// Across the diagonals of a grid.
    Shear,
    /// Across two threads, or between the vertices opposite to an edge.
    Bend,
    /// A stitch of a seam.
    Seam,
}

/// All that a spring has besides its two particles. Springs that are alike share one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringKind {
    /// What the spring is for.
    pub class: SpringClass,
    /// Rest length \[m\].
    pub rest_length: f64,
    /// Stiffness \[N/m\].
    pub stiffness: f64,
    /// Damping along the spring \[N s/m\].
    pub damping: f64,
    /// Flexural rigidity \[N m^2\] of the strut that the spring is under compression, above zero;
    /// `None` for a spring that never buckles. Bend springs alone have one.
    pub rigidity: Option<f64>,
}

/// One spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// The two particles, the smaller index first.
    pub particles: [u32; 2],
    /// Index into [`Springs::kinds`].
    pub kind: u32,
}

/// All springs of a model.
///
/// Each spring is stored once, in the row of its particle with the smaller index: the upper
/// triangle of a symmetric matrix in compressed sparse rows, columns ascending. The index of a
/// spring is its place in this order. [`Springs::gather_rows`] expands it to the full matrix.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Springs {
    row_offsets: Vec<u32>,
    columns: Vec<u32>,
    kind_indices: Vec<u32>,
    kinds: Vec<SpringKind>,
}

/// The full symmetric matrix: row i holds every spring of particle i, columns ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpringRows {
    /// Where each row starts, length n + 1.
    pub offsets: Vec<u32>,
    /// The particle at the other end, length twice the number of springs.
    pub columns: Vec<u32>,
    /// Index into [`Springs::kinds`], as long as `columns`.
    pub kinds: Vec<u32>,
}

impl Springs {
    /// Number of springs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether there is no spring.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// The distinct kinds of springs.
    #[must_use]
    pub fn kinds(&self) -> &[SpringKind] {
        &self.kinds
    }

    /// The springs whose smaller particle is `particle`, as indices.
    #[must_use]
    pub fn row(&self, particle: usize) -> Range<usize> {
        self.row_offsets[particle] as usize..self.row_offsets[particle + 1] as usize
    }

    /// The larger particle of each spring.
    #[must_use]
    pub fn columns(&self) -> &[u32] {
        &self.columns
    }

    /// The index into [`Self::kinds`] of each spring.
    #[must_use]
    pub fn kind_indices(&self) -> &[u32] {
        &self.kind_indices
    }

    /// All springs in order.
    pub fn iter(&self) -> impl Iterator<Item = Spring> + '_ {
        (0..self.row_offsets.len().saturating_sub(1)).flat_map(move |i| {
            self.row(i).map(move |s| Spring {
                particles: [i as u32, self.columns[s]],
                kind: self.kind_indices[s],
            })
        })
    }

    /// Whether a spring joins `a` and `b`.
    #[must_use]
    pub fn joins(&self, a: u32, b: u32) -> bool {
        let row = self.row(a.min(b) as usize);
        self.columns[row].binary_search(&a.max(b)).is_ok()
    }

    /// A kind to change.
    pub(super) fn kind_mut(&mut self, kind: u32) -> &mut SpringKind {
        &mut self.kinds[kind as usize]
    }

    /// The full symmetric matrix, for backends that gather forces row by row.
    #[must_use]
    pub fn gather_rows(&self) -> SpringRows {
        let particles = self.row_offsets.len().saturating_sub(1);
        let mut offsets = vec![0_u32; particles + 1];
        for spring in self.iter() {
            for particle in spring.particles {
                offsets[particle as usize + 1] += 1;
            }
        }
        for i in 0..particles {
            offsets[i + 1] += offsets[i];
        }
        let mut columns = vec![0; 2 * self.len()];
        let mut kinds = vec![0; 2 * self.len()];
        let mut next = offsets.clone();
        // Springs come sorted by (i, j). Row j receives its smaller neighbours i in ascending order
        // before its own row is reached, and its larger ones after that: rows end up sorted.
        for spring in self.iter() {
            let [i, j] = spring.particles;
            for (row, column) in [(i, j), (j, i)] {
                let slot = &mut next[row as usize];
                columns[*slot as usize] = column;
                kinds[*slot as usize] = spring.kind;
                *slot += 1;
            }
        }
        SpringRows { offsets, columns, kinds }
    }
}

/// Collects springs of several cloths. Each cloth hands in its springs sorted by (i, j).
#[derive(Default)]
pub(crate) struct SpringsBuilder {
    springs: Springs,
    kind_of: HashMap<(SpringClass, [u64; 3], Option<u64>), u32>,
}

impl SpringsBuilder {
    /// The index of `kind`, which is added if it is new.
    pub(crate) fn kind(&mut self, kind: SpringKind) -> u32 {
        let numbers = [kind.rest_length, kind.stiffness, kind.damping];
        let key = (kind.class, numbers.map(f64::to_bits), kind.rigidity.map(f64::to_bits));
        *self.kind_of.entry(key).or_insert_with(|| {
            self.springs.kinds.push(kind);
            self.springs.kinds.len() as u32 - 1
        })
    }

    /// The index of a new kind that no other spring shares.
    pub(crate) fn kind_own(&mut self, kind: SpringKind) -> u32 {
        self.springs.kinds.push(kind);
        self.springs.kinds.len() as u32 - 1
    }

    /// Adds springs between any particles, sorted, once all rows are there; the particles of one that is there already if there
    /// is such a one.
    pub(crate) fn insert(&mut self, added: &[([u32; 2], u32)]) -> Result<(), [u32; 2]> {
        if added.is_empty() {
            return Ok(());
        }
        let before = std::mem::take(&mut self.springs);
        let mut added = added.iter().peekable();
        for row in 0..before.row_offsets.len() {
            let end = before.row_offsets.get(row + 1);
            let end = end.map_or(before.columns.len(), |&end| end as usize);
            let own = before.row_offsets[row] as usize..end;
            let mut entries: Vec<(u32, u32)> =
                own.map(|place| (before.columns[place], before.kind_indices[place])).collect();
            while let Some(([_, column], kind)) = added.next_if(|([i, _], _)| *i as usize == row) {
                entries.push((*column, *kind));
            }
            entries.sort_unstable();
            if let Some(pair) = entries.windows(2).find(|pair| pair[0].0 == pair[1].0) {
                return Err([row as u32, pair[0].0]);
            }
            self.row_begin();
            entries.into_iter().for_each(|(column, kind)| self.spring(column, kind));
        }
        self.springs.kinds = before.kinds;
        Ok(())
    }

    /// Ends the row of the current particle and starts the next one.
    pub(crate) fn row_begin(&mut self) {
        self.springs.row_offsets.push(self.springs.columns.len() as u32);
    }

    /// Adds a spring to the current row; `column` is larger than the row and than all before it.
    pub(crate) fn spring(&mut self, column: u32, kind: u32) {
        self.springs.columns.push(column);
        self.springs.kind_indices.push(kind);
    }

    pub(crate) fn len(&self) -> usize {
        self.springs.columns.len()
    }

    pub(crate) fn finish(mut self) -> Springs {
        self.row_begin();
        self.springs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_differ_by_their_rigidity() {
        let mut builder = SpringsBuilder::default();
        let mut kind = |rigidity| {
            builder.kind(SpringKind {
                class: SpringClass::Bend,
                rest_length: 0.1,
                stiffness: 1.0,
                damping: 0.0,
                rigidity,
            })
        };
        let found = [None, Some(1e-6), Some(2e-6), Some(1e-6), None].map(&mut kind);
        assert_eq!(found, [0, 1, 2, 1, 0]);
    }

    #[test]
    fn gather_rows_are_symmetric_and_sorted() {
        let mut builder = SpringsBuilder::default();
        let kind = |rest_length| SpringKind {
            class: SpringClass::Stretch,
            rest_length,
            stiffness: 1.0,
            damping: 0.0,
            rigidity: None,
        };
        let upper: [&[u32]; 4] = [&[1, 3], &[2, 3], &[3], &[]];
        for row in upper {
            builder.row_begin();
            for &column in row {
                let kind = builder.kind(kind(f64::from(column)));
                builder.spring(column, kind);
            }
        }
        let springs = builder.finish();
        assert_eq!(springs.kinds().len(), 3, "equal kinds are shared");
        let rows = springs.gather_rows();
        assert_eq!(rows.offsets, [0, 2, 5, 7, 10]);
        assert_eq!(rows.columns, [1, 3, 0, 2, 3, 1, 3, 0, 1, 2]);
        assert!(springs.joins(3, 0) && springs.joins(2, 1) && !springs.joins(0, 2));
    }
}
