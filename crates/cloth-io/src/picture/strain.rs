//! The heat map: how far cloth is stretched at each particle.

use cloth_core::{Model, StrainGauge, StrainMeasure};
use glam::Vec3;

/// What tells how far the cloths of a model are stretched, for whoever has positions alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrainMap {
    particle_count: usize,
    triangle_count: usize,
    gauge: StrainGauge,
    /// Ends of springs, with their length at rest \[m\].
    springs: Vec<([u32; 2], f64)>,
}

impl StrainMap {
    /// The measures of a model.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let kinds = model.springs().kinds();
        let rest = |kind: u32| kinds[kind as usize].rest_length;
        let springs = model.springs().iter().map(|spring| (spring.particles, rest(spring.kind)));
        Self {
            particle_count: model.particle_count(),
            triangle_count: model.triangles().len(),
            gauge: StrainGauge::new(model),
            springs: springs.collect(),
        }
    }

    /// Number of particles of the model.
    #[must_use]
    pub fn particle_count(&self) -> usize {
        self.particle_count
    }

    /// Number of triangles of the model.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// Largest strain at each particle at `positions` \[m\], not below zero: that of its triangles of fabric, and of its springs length over length
    /// at rest less 1, which count as stretch alone. Both have length n.
    #[must_use]
    pub fn at_particles(&self, positions: &[[f64; 3]], measure: StrainMeasure) -> Vec<f64> {
        let mut strains = vec![0.0_f64; positions.len()];
        let mut add = |particles: &[u32], strain: f64| {
            for &particle in particles {
                let largest = &mut strains[particle as usize];
                *largest = largest.max(strain);
            }
        };
        for triangle in self.gauge.measure(positions) {
            add(&triangle.particles, measure.of(&triangle));
        }
        let has_springs = measure == StrainMeasure::Stretch;
        for (ends, rest) in self.springs.iter().filter(|_| has_springs) {
            let [a, b] = ends.map(|particle| glam::DVec3::from(positions[particle as usize]));
            add(ends, a.distance(b) / rest - 1.0);
        }
        strains
    }
}

/// The colour of a share of the elongation shown as hottest, in linear light: from blue over green and yellow to red.
pub(super) fn heat(share: f32) -> Vec3 {
    const COLORS: [Vec3; 5] = [
        Vec3::new(0.02, 0.06, 0.42),
        Vec3::new(0.02, 0.42, 0.52),
        Vec3::new(0.10, 0.60, 0.12),
        Vec3::new(0.90, 0.68, 0.05),
        Vec3::new(0.80, 0.04, 0.03),
    ];
    let place = share.clamp(0.0, 1.0) * (COLORS.len() - 1) as f32;
    let below = (place as usize).min(COLORS.len() - 2);
    COLORS[below].lerp(COLORS[below + 1], place - below as f32)
}

#[cfg(test)]
mod tests {
    use cloth_core::{Cloth, GridPatch, MaterialPreset, ModelBuilder};

    use super::*;

    #[test]
    fn springs_are_as_long_as_they_are() {
        let cloth = Cloth::grid("springs", GridPatch::new([4, 4], 0.1), &MaterialPreset::DENIM);
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let map = StrainMap::new(&model);
        let stretched: Vec<_> =
            model.positions().iter().map(|&[x, y, z]| [1.2 * x, y, z]).collect();
        let at = |positions: &[[f64; 3]], measure| map.at_particles(positions, measure);
        let [stretch, shear] = [StrainMeasure::Stretch, StrainMeasure::Shear];
        assert!(at(model.positions(), stretch).iter().all(|strain| strain.abs() < 1e-12));
        assert!(at(&stretched, stretch).iter().all(|strain| (strain - 0.2).abs() < 1e-12));
        assert!(at(&stretched, shear).iter().all(|strain| *strain == 0.0));
    }

    #[test]
    fn heat_goes_from_blue_to_red() {
        assert!(heat(-1.0).z > 5.0 * heat(-1.0).x);
        assert!(heat(2.0).x > 5.0 * heat(2.0).z);
        assert!(heat(0.5).y > 3.0 * heat(0.5).x, "green in the middle");
        assert!(heat(0.1).distance(heat(0.9)) > 0.3);
    }
}
