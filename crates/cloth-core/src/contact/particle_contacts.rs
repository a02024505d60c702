//! Which contacts each particle has.

use std::ops::Range;

use rayon::prelude::*;

use crate::Real;

use super::ContactStencil;

/// Contacts for which another thread pays.
const LINKED: usize = 8192;

/// Contacts of each node that takes part, with its place there.
#[derive(Clone, Debug)]
pub(super) struct ParticleContacts {
    /// Where the row of each node begins, and the end.
    offsets: Vec<u32>,
    /// 4 c + a for place a of contact c, ascending in each row.
    places: Vec<u32>,
}

impl ParticleContacts {
    /// No contacts, of so many nodes.
    pub(super) fn new(count: usize) -> Self {
        Self { offsets: vec![0; count + 1], places: Vec::new() }
    }

    /// Offsets of the rows, and what is in them.
    pub(super) fn get(&self) -> (&[u32], &[u32]) {
        (&self.offsets, &self.places)
    }

    /// The row of a node.
    #[inline(always)]
    pub(super) fn of(&self, node: usize) -> &[u32] {
        &self.places[self.offsets[node] as usize..self.offsets[node + 1] as usize]
    }

    /// No contacts any more.
    pub(super) fn clear(&mut self) {
        if !self.places.is_empty() {
            self.offsets.fill(0);
            self.places.clear();
        }
    }

    /// Takes in these contacts. Where there are many, each thread has the rows of some nodes and looks at all contacts for them.
    pub(super) fn link<T: Real>(&mut self, stencils: &[ContactStencil<T>]) {
        let Self { offsets, places } = self;
        let count = offsets.len() - 1;
        let threads = (stencils.len() / LINKED).clamp(1, rayon::current_num_threads());
        if threads == 1 {
            fill(stencils, 0..count as u32, &mut offsets[..count], places);
        } else {
            let share = count.div_ceil(threads).max(1);
            let parts = offsets[..count].chunks_mut(share).map(|part| (part, Vec::new()));
            let mut parts: Vec<_> = parts.collect();
            parts.par_iter_mut().enumerate().for_each(|(part, (offsets, places))| {
                let first = (part * share) as u32;
                fill(stencils, first..first + offsets.len() as u32, offsets, places);
            });
            places.clear();
            for (offsets, own) in &mut parts {
                let before = places.len() as u32;
                offsets.iter_mut().for_each(|offset| *offset += before);
                places.append(own);
            }
        }
        offsets[count] = places.len() as u32;
    }
}

/// The rows of some nodes: where each begins, and what is in it.
fn fill<T: Real>(
    stencils: &[ContactStencil<T>],
    nodes: Range<u32>,
    offsets: &mut [u32],
    places: &mut Vec<u32>,
) {
    offsets.fill(0);
    let row = |stencil: &ContactStencil<T>, corner: usize| {
        let node = stencil.particles[corner];
        let acts = stencil.weights[corner] != T::ZERO && nodes.contains(&node);
        acts.then(|| (node - nodes.start) as usize)
    };
    for stencil in stencils {
        (0..4).filter_map(|corner| row(stencil, corner)).for_each(|row| offsets[row] += 1);
    }
    let mut end = 0;
    for offset in &mut *offsets {
        end += *offset;
        *offset = end;
    }
    places.resize(end as usize, 0);
    // Filled from the end, so that offsets are where rows start in the end.
    for (contact, stencil) in stencils.iter().enumerate().rev() {
        for corner in (0..4).rev() {
            if let Some(row) = row(stencil, corner) {
                offsets[row] -= 1;
                places[offsets[row] as usize] = (4 * contact + corner) as u32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{ContactKey, ContactKind};

    #[test]
    fn rows_are_the_same_for_any_number_of_threads() {
        let count = 500;
        let stencils: Vec<_> = (0..20_000_u32)
            .map(|c| ContactStencil {
                key: ContactKey { kind: ContactKind::VertexFace, first: c, second: 0 },
                particles: [7 * c, 11 * c + 1, 13 * c + 2, c / 50].map(|i| i % count),
                weights: [1.0, -0.5, if c % 3 == 0 { 0.0 } else { -0.25 }, -0.25],
                normal: [0.0, 0.0, 1.0],
                gap: 1e-3,
                reach: 2e-3,
                friction: 0.0,
            })
            .collect();
        let linked = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut rows = ParticleContacts::new(count as usize);
            pool.install(|| rows.link::<f64>(&stencils));
            rows
        };
        let alone = linked(1);
        for node in 0..count as usize {
            let acts = |c: usize, a: usize| stencils[c].weights[a] != 0.0;
            let places = (0..stencils.len()).flat_map(|c| (0..4).map(move |a| (c, a)));
            let own =
                places.filter(|&(c, a)| stencils[c].particles[a] as usize == node && acts(c, a));
            assert!(own.map(|(c, a)| (4 * c + a) as u32).eq(alone.of(node).iter().copied()));
        }
        assert_eq!(alone.get(), linked(7).get());
    }
}
