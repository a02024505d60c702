//! The certificate of a run of pairs: comparisons along the axes of space first, then what is left side by side.

use cloth_core::{
    Real,
    contact::{Split, UnprovenPair, Ways, certify_at_start},
};
use pulp::NullaryFnOnce;

use super::{
    batch::{Batch, LANES, coordinates, points},
    bounds::{Ends, boxes},
    pairs::Run,
};

/// The pairs of a run that nothing proves, compiled for each instruction set.
pub(super) struct ProofTask<'a, T> {
    pub(super) run: &'a Run,
    pub(super) ways: Ways<'a, T>,
    /// The same, vertex by vertex.
    pub(super) ends: &'a [Ends<T>],
    /// If there are any, pairs without a marked particle are left out.
    pub(super) marked: Option<&'a [bool]>,
}

impl<T: Real> NullaryFnOnce for ProofTask<'_, T> {
    type Output = Vec<UnprovenPair>;

    #[inline(always)]
    fn call(self) -> Vec<UnprovenPair> {
        let mut left = Vec::new();
        self.look(Split::VertexTriangle, &self.run.vertex_triangle, &mut left);
        self.look(Split::EdgeEdge, &self.run.edge_edge, &mut left);
        left
    }
}

impl<T: Real> ProofTask<'_, T> {
    /// The pairs of one kind. Most are proven by an axis of space; the others wait until there are enough of them.
    #[inline(always)]
    fn look(&self, split: Split, pairs: &[UnprovenPair], left: &mut Vec<UnprovenPair>) {
        let Some(&first) = pairs.first() else { return };
        let mut unproven = Batch::new(first);
        for pair in pairs {
            // Few have a mark: coordinates of others are not looked at.
            if !self.is_asked(pair) {
                continue;
            }
            let [own, other] = boxes(split, pair.particles, self.ends);
            if !own.is_proven_apart(&other, self.ways.delta) && unproven.push(pair) {
                self.prove(split, &unproven, left);
                unproven.count = 0;
            }
        }
        self.prove(split, &unproven, left);
    }

    /// Whether a pair has a marked particle, where marks matter.
    #[inline(always)]
    fn is_asked(&self, pair: &UnprovenPair) -> bool {
        let Some(marked) = self.marked else { return true };
        let [a, b, c, d] = pair.particles;
        let [a, b] = [marked[a as usize], marked[b as usize]];
        a | b | marked[c as usize] | marked[d as usize]
    }

    /// Looks at the pairs of a batch that no axis of space proves: along the closest vector at the start, side by side, then at what is
    /// left.
    #[inline(always)]
    fn prove(&self, split: Split, batch: &Batch, left: &mut Vec<UnprovenPair>) {
        if batch.count == 0 {
            return;
        }
        let Ways { start, end, delta, is_new, follows: _ } = self.ways;
        let (from, to) = (coordinates(&batch.pairs, start), coordinates(&batch.pairs, end));
        let mut is_proven = [false; LANES];
        for lane in 0..LANES {
            let (from, to) = (points(&from, lane), points(&to, lane));
            is_proven[lane] = certify_at_start(&from, &to, split, delta);
        }
        for (pair, is_proven) in batch.pairs.iter().zip(is_proven).take(batch.count) {
            if !is_proven && pair.is_unproven(start, end, (delta, is_new)) {
                left.push(*pair);
            }
        }
    }
}
