//! Groups of particles, groups of these groups and so on: the tables of the preconditioner `schwarz` (NUMERICS §5).

use super::{Model, groups::bisect_aligned};

/// Particles in groups, and groups in groups of groups, up to a level that is small enough for a dense matrix.
///
/// The tables are static: they follow from connectivity and from the positions in which a model starts. A backend reads them as
/// they are. Nodes of level 0 are particles in the order of [`order`](Self::order); nodes of level l + 1 are the groups of level l,
/// and these are runs of nodes, given by where they start.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupHierarchy {
    order: Vec<u32>,
    levels: Vec<Vec<u32>>,
}

impl GroupHierarchy {
    /// Particles in a group at most.
    pub const GROUP: usize = 32;
    /// Groups in a group of groups at most.
    pub const CLUSTER: usize = 8;
    /// Consecutive nodes of a level above the particles whose block is inverted to smooth: 16 with six unknowns each are a
    /// matrix as large as that of a group of particles.
    pub const SMOOTHED: usize = 16;
    /// Nodes of the last level at most, where that is the first one, the second and so on: what is dense there has to cost little beside the levels below.
    const BOTTOM: [usize; 4] = [64, 128, 128, 256];
    /// Levels above the particles at most: two groups side by side have more nodes than one may, so that 2^32 particles are 2^28 groups, and each level
    /// has a quarter of the nodes of the one below, until there are 2^8.
    pub const LEVELS_MAX: usize = 11;

    /// The groups of a model. Connectivity comes first: a group has particles of one connected piece, unless whole pieces fit into
    /// it. Particles that nothing connects are grouped by their places.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let mut pieces = model.connected_pieces();
        let mut connected = vec![false; model.particle_count()];
        pieces.iter().flatten().for_each(|&particle| connected[particle as usize] = true);
        let single: Vec<u32> = (0..model.particle_count() as u32)
            .filter(|&particle| !connected[particle as usize])
            .collect();
        if !single.is_empty() {
            pieces.push(single);
        }
        let sizes = pieces.iter().map(Vec::len).collect();
        let mut order = Vec::with_capacity(model.particle_count());
        for mut piece in pieces {
            bisect_aligned(model.positions(), &mut piece, Self::GROUP, Self::CLUSTER);
            order.extend(piece);
        }
        Self { order, levels: levels(sizes) }
    }

    /// Nodes at most of the last of so many levels of groups.
    fn bottom(levels: usize) -> usize {
        let [.., most] = Self::BOTTOM;
        Self::BOTTOM.get(levels - 1).copied().unwrap_or(most)
    }

    /// The particles, those of a group one after the other.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// For each level but the last where the groups of its nodes start, and the end. There is at least one level of groups.
    #[must_use]
    pub fn levels(&self) -> &[Vec<u32>] {
        &self.levels
    }
}

/// The groups of all levels for pieces of these sizes.
fn levels(mut pieces: Vec<usize>) -> Vec<Vec<u32>> {
    let mut levels = Vec::new();
    let mut size = GroupHierarchy::GROUP;
    loop {
        let (starts, next) = groups(&pieces, size);
        let count = starts.len() - 1;
        levels.push(starts);
        if count <= GroupHierarchy::bottom(levels.len()) {
            return levels;
        }
        pieces = next;
        size = GroupHierarchy::CLUSTER;
    }
}

/// Where groups of at most `size` consecutive nodes start, and the end; and the pieces that the groups make. A group has nodes of one
/// piece, or whole pieces.
fn groups(pieces: &[usize], size: usize) -> (Vec<u32>, Vec<usize>) {
    let mut starts = vec![0_u32];
    let mut next = Vec::new();
    let mut filled = 0;
    let mut end = 0;
    for &piece in pieces {
        if filled > 0 && filled + piece > size {
            starts.push(end as u32);
            next.push(1);
            filled = 0;
        }
        if piece <= size {
            filled += piece;
            end += piece;
            continue;
        }
        for start in (0..piece).step_by(size) {
            end += size.min(piece - start);
            starts.push(end as u32);
        }
        next.push(piece.div_ceil(size));
    }
    if filled > 0 {
        starts.push(end as u32);
        next.push(1);
    }
    (starts, next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pieces_share_a_group_and_large_ones_share_none() {
        let (starts, next) = groups(&[3, 4, 9, 2, 17, 1], 8);
        assert_eq!(starts, [0, 7, 15, 16, 18, 26, 34, 35, 36]);
        assert_eq!(next, [1, 2, 1, 3, 1]);
        assert_eq!(groups(&[], 8), (vec![0], vec![]));
    }

    #[test]
    fn levels_end_with_few_nodes_and_hold_every_node_once() {
        for (pieces, expected) in [
            (vec![1], 1),
            (vec![64 * 32], 1),
            (vec![64 * 32 + 1], 2),
            (vec![128 * 8 * 32], 2),
            (vec![128 * 8 * 32 + 1], 3),
            (vec![1_000_000], 4),
            (vec![256 * 8 * 8 * 8 * 32], 4),
            (vec![7; 9000], 3),
        ] {
            let mut nodes: usize = pieces.iter().sum();
            let levels = levels(pieces);
            for (level, starts) in levels.iter().enumerate() {
                let size = if level == 0 { GroupHierarchy::GROUP } else { GroupHierarchy::CLUSTER };
                assert!(
                    starts
                        .windows(2)
                        .all(|ends| { ends[0] < ends[1] && (ends[1] - ends[0]) as usize <= size })
                );
                assert_eq!(*starts.last().unwrap() as usize, nodes);
                nodes = starts.len() - 1;
            }
            assert!(nodes <= GroupHierarchy::bottom(levels.len()));
            assert_eq!(levels.len(), expected);
        }
    }
}
