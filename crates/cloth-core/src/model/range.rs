//! How far from the origin single precision reaches.

use super::{Model, Spring, SpringClass};
use crate::{ModelError, Precision};

/// Largest error of a strain that coordinates may make: their distance is that of the roundings of both ends, half an epsilon
/// each. Cloth in use is stretched by some percent.
const STRAIN_ERROR_MAX: f64 = 5e-3;

impl Model {
    /// Checks that no cloth starts where the numbers of `precision` are too coarse for its springs.
    ///
    /// # Errors
    /// [`ModelError::TooFar`], with the largest coordinate that works.
    pub fn precision_check(&self, precision: Precision) -> Result<(), ModelError> {
        if precision == Precision::F64 {
            return Ok(());
        }
        let mut sums = vec![(0.0, 0.0); self.cloths().len()];
        let kind = |spring: &Spring| self.springs().kinds()[spring.kind as usize];
        // Stitches close to nothing.
        for spring in self.springs().iter().filter(|s| kind(s).class != SpringClass::Seam) {
            let (sum, count) = &mut sums[self.cloth_of(spring.particles[0])];
            *sum += kind(&spring).rest_length;
            *count += 1.0;
        }
        for triangle in self.elements().triangles() {
            let (sum, count) = &mut sums[self.cloth_of(triangle.particles[0])];
            *sum += (2.0 * triangle.rest.area).sqrt();
            *count += 1.0;
        }
        for (cloth, (sum, count)) in self.cloths().iter().zip(sums) {
            let particles = cloth.particles.start as usize..cloth.particles.end as usize;
            let coordinates = self.positions()[particles].iter().flatten();
            let distance = coordinates.fold(0.0, |largest: f64, x| largest.max(x.abs()));
            let rest_length = sum / count;
            let largest = STRAIN_ERROR_MAX * rest_length / f64::from(f32::EPSILON);
            // Particles without springs have no strain.
            if distance > largest {
                return Err(ModelError::TooFar {
                    cloth: cloth.name.clone(),
                    distance,
                    rest_length,
                    largest,
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder};

    /// A spacing of 2 cm at 10 km had a strain of 0.136 at rest.
    #[test]
    fn cloth_far_from_the_origin_needs_double_precision() {
        let patch = |x| {
            let grid = GridPatch { origin: [x, 0.0, 0.0], ..GridPatch::horizontal(4, 0.02, 0.0) };
            let cloth = Cloth {
                name: "patch".into(),
                geometry: Geometry::Grid(grid),
                material: MaterialPreset::ALL[0].material(0.02).into(),
                pins: vec![],
                velocity: [0.0; 3],
            };
            ModelBuilder::new().cloth(cloth).build().unwrap()
        };
        let error = patch(1e4).precision_check(Precision::F32).unwrap_err();
        let ModelError::TooFar { largest, .. } = error else { panic!("{error}") };
        assert!((800.0..2000.0).contains(&largest), "{error}");
        assert!(error.to_string().contains("patch"), "{error}");
        assert!(patch(1e4).precision_check(Precision::F64).is_ok());
        assert!(patch(0.99 * largest - 1.0).precision_check(Precision::F32).is_ok());
        assert!(patch(1.01 * largest).precision_check(Precision::F32).is_err());
    }
}
