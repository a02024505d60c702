//! NUMERICS §10: the blocks of `measure.cu` added in order.

use cloth_core::Measures;

/// Figures of a block, as `measure.cu` writes them.
pub(crate) const FIGURES: usize = 16;
/// Figures of a block of triangles of fabric, as `measure.cu` writes them.
pub(crate) const FABRIC_FIGURES: usize = 4;

/// Figures of all triangles of fabric.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FabricSums {
    strain_max: f64,
    strain_particle: u32,
    strain: f64,
    count: f64,
    energy: f64,
}

impl FabricSums {
    /// Adds the partial sums of blocks of `count` triangles.
    pub(crate) fn new(count: usize, partials: &[f64]) -> Self {
        let mut sums = Self {
            strain_max: -1.0,
            strain_particle: 0,
            strain: 0.0,
            count: count as f64,
            energy: 0.0,
        };
        for block in partials.chunks_exact(FABRIC_FIGURES) {
            if block[0] > sums.strain_max {
                sums.strain_max = block[0];
                sums.strain_particle = block[1] as u32;
            }
            sums.strain += block[2];
            sums.energy += block[3];
        }
        sums
    }
}

/// Adds the partial sums of all blocks.
pub(crate) fn total(partials: &[f64], fabric: FabricSums) -> Measures {
    let mut measures = Measures { strain_max: -1.0, ..Measures::default() };
    let (mut ends, mut magnitude, mut force) = (0.0, 0.0, [0.0; 3]);
    for block in partials.chunks_exact(FIGURES) {
        if block[15] >= 0.0 && measures.non_finite_particle.is_none() {
            measures.non_finite_particle = Some(block[15] as u32);
        }
        if block[0] > measures.strain_max {
            measures.strain_max = block[0];
            measures.strain_particle = block[1] as u32;
        }
        measures.strain_mean += block[2];
        ends += block[3];
        measures.penetration_max = measures.penetration_max.max(block[14]);
        measures.energy_kinetic += block[12];
        measures.energy_elastic += block[4];
        measures.energy_potential += block[13];
        for axis in 0..3 {
            measures.momentum[axis] += block[9 + axis];
            force[axis] += block[5 + axis];
        }
        magnitude += block[8];
    }
    if fabric.strain_max > measures.strain_max {
        measures.strain_max = fabric.strain_max;
        measures.strain_particle = fabric.strain_particle;
    }
    measures.strain_mean += 2.0 * fabric.strain;
    ends += 2.0 * fabric.count;
    measures.energy_elastic += fabric.energy;
    let length = force.iter().map(|c| c * c).sum::<f64>().sqrt();
    // Still where it began: no strain was measured.
    if measures.strain_max <= -1.0 {
        measures.strain_max = 0.0;
    }
    measures.strain_mean /= f64::max(ends, 1.0);
    measures.momentum_drift = length / f64::max(magnitude, f64::MIN_POSITIVE);
    measures
}
