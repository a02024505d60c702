//! The contours along which sheets intersect: chains of crossings.

use cloth_audit::Crossing;

use crate::mesh::Surfaces;

/// An edge through a triangle, as part of a contour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) crossing: Crossing,
    /// On which of the two sheets of the contour the edge is; the triangle is on the other one.
    pub(crate) sheet: usize,
}

/// The crossings of each contour. Two crossings are neighbours in one if a pair of triangles has both: the contour is the line in which the two
/// meet. Each side of that line is a sheet.
pub(crate) fn contours(surfaces: &Surfaces<'_>, crossed: &[Crossing]) -> Vec<Vec<Link>> {
    // The pairs of triangles that a crossing joins, and whether the edge is on the first one.
    let pairs_of = |crossing: &Crossing| {
        let through = surfaces.face(crossing.surface, crossing.triangle as u32);
        let faces = surfaces.faces_of(crossing.edge_surface, crossing.edge);
        faces.map(move |face| ([face.min(through), face.max(through)], face < through))
    };
    let mut pairs: Vec<[u32; 2]> =
        crossed.iter().flat_map(|c| pairs_of(c).map(|(pair, _)| pair)).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let number = |pair: [u32; 2]| pairs.binary_search(&pair).unwrap_or_default();
    let mut sets = Sets::new(pairs.len());
    for crossing in crossed {
        let mut joined = pairs_of(crossing);
        let Some((first, is_first)) = joined.next() else { continue };
        for (other, is_other) in joined {
            sets.join([number(first), number(other)], is_first != is_other);
        }
    }
    let mut found: Vec<(usize, Link)> = Vec::with_capacity(crossed.len());
    for crossing in crossed {
        let Some((pair, is_first)) = pairs_of(crossing).next() else { continue };
        let (root, is_turned) = sets.root(number(pair));
        found.push((root, Link { crossing: *crossing, sheet: usize::from(is_first == is_turned) }));
    }
    // Sorting is stable: the order within a contour is that of the crossings.
    found.sort_by_key(|(root, _)| *root);
    found
        .chunk_by(|a, b| a.0 == b.0)
        .map(|contour| contour.iter().map(|(_, link)| *link).collect())
        .collect()
}

/// Sets of pairs, each pair with whether its first triangle is on the other sheet than that of the pair that stands for the set.
struct Sets {
    up: Vec<(usize, bool)>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self { up: (0..count).map(|i| (i, false)).collect() }
    }

    fn root(&mut self, pair: usize) -> (usize, bool) {
        let (mut at, mut is_turned) = (pair, false);
        while self.up[at].0 != at {
            is_turned ^= self.up[at].1;
            at = self.up[at].0;
        }
        self.up[pair] = (at, is_turned);
        (at, is_turned)
    }

    fn join(&mut self, pairs: [usize; 2], differs: bool) {
        let [(a, of_a), (b, of_b)] = pairs.map(|pair| self.root(pair));
        if a != b {
            self.up[a.max(b)] = (a.min(b), of_a ^ of_b ^ differs);
        }
    }
}
