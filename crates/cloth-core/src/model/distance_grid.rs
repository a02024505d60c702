//! Signed distances of any solid, sampled on a regular grid.

use crate::{
    ModelError, TriangleMesh,
    error::{finite, finite_all, not_negative, positive},
};

/// Signed distances \[m\] at the points of a regular grid, negative inside; between them
/// trilinear interpolation, outside the grid the nearest point of it (NUMERICS §7). A solid that changes its shape
/// has several sets of them, between which distances change linearly.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DistanceGrid {
    /// Place of the first sample in the local frame \[m\].
    pub origin: [f64; 3],
    /// Distance of neighbouring samples \[m\].
    pub spacing: f64,
    /// Samples along each axis, at least 2.
    pub size: [u32; 3],
    /// The samples; that at (i, j, k) has index (k size\[1\] + j) size\[0\] + i. One set after the other, if
    /// there are several.
    pub distances: Vec<f32>,
    /// Sets for a second \[1/s\]; the last one holds from its time on. Without meaning for a single set.
    pub rate: f64,
    /// When the first set ends to hold \[s\].
    pub start: f64,
    /// How far outside of `surface` is what cloth feels \[m\]; the samples have it in them.
    pub skin: f64,
    /// The surface that was sampled, for pictures.
    pub surface: TriangleMesh,
    /// The vertices of the surface for each set but the first \[m\], or none.
    pub later_positions: Vec<Vec<[f64; 3]>>,
}

/// The sets of samples that hold at one time: those with number `index` and `next`, of the second
/// the share `share`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridSets {
    /// Number of the set at or before the time.
    pub index: u32,
    /// Number of the following one; the same one if there is none.
    pub next: u32,
    /// Share of the following one, 0 to 1.
    pub share: f64,
}

impl GridSets {
    /// Those of `count` sets, `rate` of them for a second \[1/s\], that hold `time` \[s\] after the time of the first.
    #[must_use]
    pub fn at(count: usize, rate: f64, time: f64) -> Self {
        let last = count.saturating_sub(1) as f64;
        // Before its time the first set is not on its way to the next: nothing moves.
        if last == 0.0 || time < 0.0 {
            return Self::default();
        }
        let place = (rate * time).clamp(0.0, last);
        let index = place.floor();
        Self { index: index as u32, next: (index + 1.0).min(last) as u32, share: place - index }
    }
}

impl DistanceGrid {
    /// Most samples of a grid, all sets together.
    pub const SAMPLES_MAX: u64 = 1 << 28;

    /// Samples of a set.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.size.iter().map(|&side| side as usize).product()
    }

    /// Number of sets.
    #[must_use]
    pub fn set_count(&self) -> usize {
        self.distances.len() / self.samples().max(1)
    }

    /// The sets that hold at `time` \[s\].
    #[must_use]
    pub fn sets_at(&self, time: f64) -> GridSets {
        GridSets::at(self.set_count(), self.rate, time - self.start)
    }

    /// The vertices of the surface at `time` \[s\].
    #[must_use]
    pub fn positions_at(&self, time: f64) -> Vec<[f64; 3]> {
        let GridSets { index, next, share } = self.sets_at(time);
        let pairs = self.positions_of_set(index).iter().zip(self.positions_of_set(next));
        pairs
            .map(|(a, b)| std::array::from_fn(|axis| a[axis] + share * (b[axis] - a[axis])))
            .collect()
    }

    /// The vertices of the surface of one set.
    pub(super) fn positions_of_set(&self, number: u32) -> &[[f64; 3]] {
        let later = (number as usize).checked_sub(1);
        later.and_then(|at| self.later_positions.get(at)).unwrap_or(&self.surface.positions)
    }

    /// The distance of a point of the local frame from the surface at `time` \[s\], as NUMERICS §7 has it \[m\].
    #[must_use]
    pub fn distance_at(&self, point: [f64; 3], time: f64) -> f64 {
        let mut cell = [0; 3];
        let mut share = [0.0; 3];
        let mut beyond = 0.0;
        for axis in 0..3 {
            let place = (point[axis] - self.origin[axis]) / self.spacing;
            let last = self.size[axis].saturating_sub(1);
            let clamped = place.max(0.0).min(f64::from(last));
            cell[axis] = (clamped as usize).min(last.saturating_sub(1) as usize);
            share[axis] = clamped - cell[axis] as f64;
            beyond += ((place - clamped) * self.spacing).powi(2);
        }
        let [width, height, _] = self.size.map(|side| side as usize);
        let in_set = |set: u32| {
            let corner =
                |bits: usize| {
                    let at = |axis: usize| cell[axis] + (bits >> axis & 1);
                    let index = (at(2) * height + at(1)) * width + at(0);
                    let weight = (0..3).map(|axis| {
                        if bits >> axis & 1 == 1 { share[axis] } else { 1.0 - share[axis] }
                    });
                    let sample = self.distances.get(set as usize * self.samples() + index);
                    weight.product::<f64>() * f64::from(sample.copied().unwrap_or_default())
                };
            (0..8).map(corner).sum::<f64>()
        };
        let sets = self.sets_at(time);
        let now = in_set(sets.index);
        now + sets.share * (in_set(sets.next) - now) + beyond.sqrt()
    }

    pub(super) fn validate(&self, name: &str) -> Result<(), ModelError> {
        finite_all(|| format!("origin of the distances of collider {name:?}"), &self.origin)?;
        positive(|| format!("spacing of the distances of collider {name:?}"), self.spacing)?;
        let count: u64 = self.size.iter().map(|&side| u64::from(side)).product();
        let found = self.distances.len() as u64;
        let is_whole = count > 0 && found > 0 && found.is_multiple_of(count);
        if self.size.iter().any(|&side| side < 2) || !is_whole || found > Self::SAMPLES_MAX {
            return Err(ModelError::LengthMismatch {
                what: "the distances of a collider",
                found: self.distances.len(),
                expected: usize::try_from(count).unwrap_or(usize::MAX),
            });
        }
        finite(|| format!("start of the motion of collider {name:?}"), self.start)?;
        not_negative(|| format!("skin of collider {name:?}"), self.skin)?;
        if found > count {
            positive(|| format!("sets of distances per second of collider {name:?}"), self.rate)?;
        }
        match self.distances.iter().find(|distance| !distance.is_finite()) {
            Some(&value) => Err(ModelError::NonFinite {
                what: format!("a distance of collider {name:?}"),
                value: value.into(),
            }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_distances_are_exact_and_go_on_outside() {
        let size = [3, 4, 5];
        let mut grid = DistanceGrid {
            origin: [-1.0, 0.0, 2.0],
            spacing: 0.5,
            size,
            rate: 2.0,
            ..DistanceGrid::default()
        };
        for set in 0..2 {
            for k in 0..size[2] {
                // Half the height above 2 m, which falls by a metre within half a second.
                let sample = 0.5 * (0.5 * k as f32) - set as f32;
                grid.distances.extend(vec![sample; (size[0] * size[1]) as usize]);
            }
        }
        let at = |point, time| grid.distance_at(point, time);
        assert!((at([-0.7, 0.8, 2.6], 0.0) - 0.3).abs() < 1e-12);
        assert!((at([-0.7, 0.8, 2.6], 0.25) + 0.2).abs() < 1e-12, "between the sets");
        assert!((at([-0.7, 0.8, 2.6], 9.0) + 0.7).abs() < 1e-12, "the last one stays");
        assert!((at([3.0, 0.8, 2.6], 0.0) - 3.3).abs() < 1e-12, "three metres beside it");
        grid.start = 2.0;
        assert_eq!(grid.sets_at(1.9), GridSets::default(), "it waits, and nothing moves");
        assert_eq!(grid.sets_at(2.25), GridSets { index: 0, next: 1, share: 0.5 });
        assert!((grid.distance_at([-0.7, 0.8, 2.6], 2.25) + 0.2).abs() < 1e-12);
    }
}
