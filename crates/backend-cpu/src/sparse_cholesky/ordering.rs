//! Order of elimination: nested dissection from rest positions (George 1973).
//!
//! A set of particles is cut across its longest side into two halves; those of the first half that
//! have a neighbour in the second separate them and are eliminated after both. The halves are
//! divided in the same way, down to small sets. Pieces that no spring joins start as sets of their
//! own.

use super::pattern::Neighbourhood;

/// Sets of this size are not divided further: they end up as one dense block.
const SET_SMALLEST: usize = 12;

/// The particles in the order of elimination.
pub(crate) fn nested_dissection(
    positions: &[[f64; 3]],
    neighbourhood: &Neighbourhood,
    pieces: &[Vec<u32>],
) -> Vec<u32> {
    let mut order = Vec::with_capacity(positions.len());
    // Sets still to be divided; a list instead of recursion, as degenerate positions may divide
    // very unevenly.
    let mut pending = Vec::new();
    for piece in pieces {
        pending.push(order.len()..order.len() + piece.len());
        order.extend_from_slice(piece);
    }
    let mut dissection = Dissection {
        positions,
        neighbourhood,
        sets: vec![0; positions.len()],
        sets_used: 0,
        half: Vec::new(),
        separator: Vec::new(),
    };
    while let Some(range) = pending.pop() {
        if let Some([first, second]) = dissection.divide(&mut order[range.clone()]) {
            let middle = range.start + first;
            pending.push(range.start..middle);
            pending.push(middle..middle + second);
        }
    }
    order
}

struct Dissection<'a> {
    positions: &'a [[f64; 3]],
    neighbourhood: &'a Neighbourhood,
    /// The second half that each particle was last in.
    sets: Vec<u32>,
    sets_used: u32,
    /// The last first half, less its separator.
    half: Vec<u32>,
    separator: Vec<u32>,
}

impl Dissection<'_> {
    /// Sorts a set into first half, second half and separator; returns the sizes of the halves.
    fn divide(&mut self, set: &mut [u32]) -> Option<[usize; 2]> {
        if set.len() <= SET_SMALLEST {
            set.sort_unstable();
            return None;
        }
        let (axis, side) = self.longest_side(set);
        // The separator comes out of the first half, which is made larger by half of it, so that
        // the halves are equal without it. How large it is shows when it is found.
        let middle = self.cut(set, (axis, side), set.len() / 2);
        let wanted = (middle + self.separator.len() / 2).min(set.len() - 1);
        let middle = self.cut(set, (axis, side), wanted);
        let [first, second] = [self.half.len(), set.len() - middle];
        if first == 0 {
            set.sort_unstable();
            return None;
        }
        // Ascending, so that patches of a grid that look alike are eliminated alike.
        self.separator.sort_unstable();
        set.copy_within(middle.., first);
        set[..first].copy_from_slice(&self.half);
        set[first + second..].copy_from_slice(&self.separator);
        Some([first, second])
    }

    /// Divides a set, about `wanted` of it in the first half, into first half, separator and second
    /// half; returns where the second half begins.
    fn cut(&mut self, set: &mut [u32], (axis, side): (usize, f64), wanted: usize) -> usize {
        let positions = self.positions;
        let key = |particle: u32| positions[particle as usize][axis];
        let (_, &mut median, _) =
            set.select_nth_unstable_by(wanted, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        // Between two lines of a grid rather than through one.
        let same = 1e-6 * side;
        let before = set[..wanted].iter().filter(|&&p| key(p) < key(median) - same).count();
        let after = set[wanted..].iter().filter(|&&p| key(p) <= key(median) + same).count();
        let (low, high) = (before, wanted + after);
        let quarter = set.len() / 4;
        let fits = |cut: usize| cut > quarter && cut < set.len() - quarter;
        let middle = match (fits(low), fits(high)) {
            (true, true) if wanted - low <= high - wanted => low,
            (_, true) => high,
            (true, false) => low,
            (false, false) => wanted,
        };
        if middle != wanted {
            set.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        }
        self.sets_used += 1;
        for &particle in &set[middle..] {
            self.sets[particle as usize] = self.sets_used;
        }
        self.half.clear();
        self.separator.clear();
        for &particle in &set[..middle] {
            let mut neighbours = self.neighbourhood.of(particle as usize).iter();
            if neighbours.any(|&other| self.sets[other as usize] == self.sets_used) {
                self.separator.push(particle);
            } else {
                self.half.push(particle);
            }
        }
        middle
    }

    /// The axis along which a set is longest, and its length there.
    fn longest_side(&self, set: &[u32]) -> (usize, f64) {
        let side = |axis: usize| {
            let values = set.iter().map(|&particle| self.positions[particle as usize][axis]);
            let [low, high] = values.fold([f64::MAX, f64::MIN], |[low, high], value| {
                [f64::min(low, value), f64::max(high, value)]
            });
            high - low
        };
        let sides = [side(0), side(1), side(2)];
        let axis = (1..3).fold(0, |a, b| if sides[b] > sides[a] { b } else { a });
        (axis, sides[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse_cholesky::pattern::tests::grid_springs;

    #[test]
    fn every_particle_has_one_place_and_separators_separate() {
        let (positions, pairs) = grid_springs(23);
        let neighbourhood = Neighbourhood::new(positions.len(), &pairs);
        let pieces = neighbourhood.pieces();
        let order = nested_dissection(&positions, &neighbourhood, &pieces);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..positions.len() as u32).collect::<Vec<_>>());
        // The first cut: without two lines of the grid the rest falls apart.
        let separator = order.len() - 2 * 23;
        let mut removed = vec![false; order.len()];
        order[separator..].iter().for_each(|&particle| removed[particle as usize] = true);
        let mut kept = pairs;
        kept.retain(|pair| !pair.iter().any(|&particle| removed[particle as usize]));
        let rest = Neighbourhood::new(order.len(), &kept);
        let mut sizes: Vec<usize> = rest.pieces().iter().map(Vec::len).collect();
        sizes.retain(|&size| size > 1);
        assert_eq!(sizes, [10 * 23, 11 * 23]);
    }
}
