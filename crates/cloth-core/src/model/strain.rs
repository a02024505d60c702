//! Which springs tell how far the cloth is stretched (NUMERICS §10).

use super::{SpringClass, Springs};

/// Rest length, in units of the usual one, below which a strain says nothing.
const REST_LENGTH_SHARE: f64 = 0.01;

impl Springs {
    /// For each kind of springs whether its strain is measured: that of edges and diagonals, along
    /// which the triangles of the cloth are stretched.
    ///
    /// A bend spring is not measured. It joins the two vertices opposite to an edge: where the
    /// cloth is folded at rest they can be as near as one likes, and unfolding it makes the
    /// spring any number of times longer, with no thread stretched. Nor is any
    /// other spring shorter than a hundredth of the usual, the median one: a gap that has been closed in a
    /// mesh is no thread either.
    #[must_use]
    pub fn strain_measured(&self) -> Vec<bool> {
        let mut counts = vec![0_usize; self.kinds().len()];
        for &kind in self.kind_indices() {
            counts[kind as usize] += 1;
        }
        let mut lengths: Vec<(f64, usize)> = self
            .kinds()
            .iter()
            .zip(counts)
            .filter(|(kind, _)| is_thread(kind.class))
            .map(|(kind, count)| (kind.rest_length, count))
            .collect();
        lengths.sort_by(|a, b| a.0.total_cmp(&b.0));
        let middle = lengths.iter().map(|(_, count)| count).sum::<usize>() / 2;
        let mut passed = 0;
        let median = lengths.iter().find(|(_, count)| {
            passed += count;
            passed > middle
        });
        let shortest = REST_LENGTH_SHARE * median.map_or(0.0, |(length, _)| *length);
        let is_measured =
            |kind: &super::SpringKind| is_thread(kind.class) && kind.rest_length >= shortest;
        self.kinds().iter().map(is_measured).collect()
    }
}

/// Whether springs of a class stand for the cloth itself.
const fn is_thread(class: SpringClass) -> bool {
    matches!(class, SpringClass::Stretch | SpringClass::Shear)
}

#[cfg(test)]
mod tests {
    use crate::{
        Cloth, Geometry, Mass, Material, MaterialPreset, ModelBuilder, NetworkSpring, SpringClass,
        SpringNetwork,
    };

    #[test]
    fn bend_springs_and_gaps_are_not_measured() {
        let positions: Vec<[f64; 3]> = (0..8).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
        let spring = |particles: [u32; 2], class, rest_length| NetworkSpring {
            particles,
            class,
            rest_length: Some(rest_length),
            coefficients: None,
        };
        let springs = (1..8)
            .map(|i| spring([i - 1, i], SpringClass::Stretch, 0.1 + 0.001 * f64::from(i)))
            .chain([
                spring([0, 2], SpringClass::Shear, 0.2),
                spring([0, 3], SpringClass::Bend, 0.3),
                spring([0, 4], SpringClass::Stretch, 1e-3),
                spring([0, 5], SpringClass::Shear, 2e-3),
            ])
            .collect();
        let model = ModelBuilder::new()
            .cloth(Cloth {
                name: "network".into(),
                geometry: Geometry::Network(SpringNetwork { positions, springs }),
                material: Material {
                    mass: Mass::PerParticle(1e-3),
                    ..MaterialPreset::ALL[0].material(0.1)
                }
                .into(),
                pins: vec![],
                velocity: [0.0; 3],
            })
            .build()
            .unwrap();
        let springs = model.springs();
        for (kind, is_measured) in springs.kinds().iter().zip(springs.strain_measured()) {
            let expected = kind.class != SpringClass::Bend && kind.rest_length > 1.1e-3;
            assert_eq!(is_measured, expected, "{kind:?}");
        }
    }
}
