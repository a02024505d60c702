//! Edges keep their lengths, and folds their angles, while particles are pushed.

use glam::DVec3;

use crate::mesh::Mesh;

/// Sweeps after each round.
const SWEEPS: usize = 8;

/// Share of a length by which it may be off.
const FREE: f64 = 0.01;

pub(crate) struct Shape<'a> {
    /// Particles that keep their distance \[m\]: the ends of edges, and the corners across them.
    pairs: Vec<([u32; 2], f64)>,
    /// How many of them are edges: the first ones.
    edges: usize,
    is_held: &'a [bool],
}

impl<'a> Shape<'a> {
    /// The shape that a cloth has now.
    pub(crate) fn new(mesh: &Mesh<'_>, at: &[DVec3], is_held: &'a [bool]) -> Self {
        let length = |[a, b]: [u32; 2]| at[a as usize].distance(at[b as usize]);
        let edges = mesh.edges.iter().map(|edge| edge.ends);
        let across = mesh.edges.iter().filter_map(|edge| mesh.across(edge));
        // Places that are no numbers ask for nothing.
        let finite = |ends: [u32; 2]| Some((ends, length(ends))).filter(|(_, l)| l.is_finite());
        let mut pairs: Vec<_> = edges.filter_map(finite).collect();
        let edges = pairs.len();
        pairs.extend(across.filter_map(finite));
        Self { pairs, edges, is_held }
    }

    /// Mean length of its edges \[m\].
    pub(crate) fn mean_edge(&self) -> f64 {
        let lengths = self.pairs[..self.edges].iter().map(|(_, length)| length);
        lengths.sum::<f64>() / self.edges.max(1) as f64
    }

    /// Moves particles towards it, all at once in each sweep, by the mean of what is asked of each.
    pub(crate) fn restore(&self, at: &mut [DVec3]) {
        let mut sums = vec![(DVec3::ZERO, 0.0); at.len()];
        for _ in 0..SWEEPS {
            sums.fill((DVec3::ZERO, 0.0));
            for &(ends, length) in &self.pairs {
                let [a, b] = ends.map(|end| end as usize);
                let way = at[b] - at[a];
                let now = way.length();
                let off = now - now.clamp((1.0 - FREE) * length, (1.0 + FREE) * length);
                if off == 0.0 || now == 0.0 {
                    continue;
                }
                let half = 0.5 * off / now * way;
                for (end, part) in [(a, half), (b, -half)] {
                    sums[end].0 += part;
                    sums[end].1 += 1.0;
                }
            }
            for (particle, (x, (sum, count))) in at.iter_mut().zip(&sums).enumerate() {
                if *count > 0.0 && !self.is_held.get(particle).is_some_and(|held| *held) {
                    *x += *sum / *count;
                }
            }
        }
    }
}
