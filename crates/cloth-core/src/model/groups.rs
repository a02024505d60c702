//! Particles in small groups that lie near each other at rest.

use super::Model;
use crate::NONE;

impl Model {
    /// The longest side of the boxes around groups of `size` particles at rest, on average \[m\].
    #[must_use]
    pub fn group_side(&self, members: &[u32], size: usize) -> f64 {
        let sides = members.chunks(size).map(|group| {
            let mut low = [f64::INFINITY; 3];
            let mut high = [f64::NEG_INFINITY; 3];
            for &particle in group.iter().filter(|&&particle| particle != NONE) {
                let x = self.positions()[particle as usize];
                for axis in 0..3 {
                    low[axis] = low[axis].min(x[axis]);
                    high[axis] = high[axis].max(x[axis]);
                }
            }
            (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max)
        });
        sides.sum::<f64>() / (members.len() / size).max(1) as f64
    }

    /// The particles of all cloths in groups of `size`: those of each cloth sorted by recursive bisection across the
    /// longest side of their rest positions, each cloth filled up to whole groups with [`NONE`].
    ///
    /// # Panics
    /// If `size` is zero.
    #[must_use]
    pub fn particle_groups(&self, size: usize) -> Vec<u32> {
        let mut order = Vec::new();
        for cloth in self.cloths() {
            let start = order.len();
            order.extend(cloth.particles.clone());
            bisect(self.positions(), &mut order[start..], size);
            order.resize(order.len().next_multiple_of(size), NONE);
        }
        order
    }
}

fn bisect(positions: &[[f64; 3]], particles: &mut [u32], size: usize) {
    bisect_at(positions, particles, size, &|_| size);
}

/// Sorts particles by recursive bisection across the longest side of their positions, into runs of `size`, runs of `cluster` such runs,
/// and so on: each half but the last has a whole number of the largest runs that leave it between a third and two thirds.
pub(super) fn bisect_aligned(
    positions: &[[f64; 3]],
    particles: &mut [u32],
    size: usize,
    cluster: usize,
) {
    bisect_at(positions, particles, size, &|count| {
        let mut run = size;
        while 2 * run * cluster <= count {
            run *= cluster;
        }
        run
    });
}

/// Bisection into runs of `size`, the first half of each with a multiple of `run(length)`.
fn bisect_at(
    positions: &[[f64; 3]],
    particles: &mut [u32],
    size: usize,
    run: &impl Fn(usize) -> usize,
) {
    if particles.len() <= size {
        return;
    }
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for &particle in particles.iter() {
        let x = positions[particle as usize];
        for axis in 0..3 {
            low[axis] = low[axis].min(x[axis]);
            high[axis] = high[axis].max(x[axis]);
        }
    }
    let side = |axis: usize| high[axis] - low[axis];
    let axis =
        (1..3).fold(0, |longest, axis| if side(axis) > side(longest) { axis } else { longest });
    let middle = (particles.len() / 2).next_multiple_of(run(particles.len()));
    particles.select_nth_unstable_by(middle.min(particles.len() - 1), |&a, &b| {
        let key = |particle: u32| positions[particle as usize][axis];
        key(a).total_cmp(&key(b)).then(a.cmp(&b))
    });
    let (low, high) = particles.split_at_mut(middle.min(particles.len()));
    bisect_at(positions, low, size, run);
    bisect_at(positions, high, size, run);
}

#[cfg(test)]
mod tests {
    use crate::{Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder};

    use super::*;

    #[test]
    fn groups_hold_every_particle_once_and_are_compact() {
        let mut builder = ModelBuilder::new();
        for name in ["a", "b"] {
            builder = builder.cloth(Cloth {
                name: name.to_owned(),
                geometry: Geometry::Grid(GridPatch::horizontal(21, 1.0, 0.0)),
                material: MaterialPreset::ALL[0].material(1.0).into(),
                pins: vec![],
                velocity: [0.0; 3],
            });
        }
        let model = builder.build().unwrap();
        let order = model.particle_groups(16);
        let mut particles: Vec<u32> = order.iter().copied().filter(|&p| p != NONE).collect();
        particles.sort_unstable();
        assert!(particles.iter().copied().eq(0..2 * 441));
        for group in order.chunks(16) {
            let mut present = group.iter().filter(|&&p| p != NONE);
            let [first, ..] = *group else { unreachable!() };
            let [x, y, _] = model.positions()[first as usize];
            assert!(present.all(|&p| {
                let at = model.positions()[p as usize];
                (p < 441) == (first < 441) && (at[0] - x).abs() < 8.0 && (at[1] - y).abs() < 8.0
            }));
        }
    }
}
