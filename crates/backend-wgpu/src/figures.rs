//! The result of the stage `measure`, from what the device sums up.

use cloth_core::{Measures, Model};

use crate::buffers::MEASURE_SIZE;

/// What the device says of a state.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Figures {
    pub(crate) measures: Measures,
    /// Pairs in contact at the last substep.
    pub(crate) contacts: u64,
}

/// No particle, where one could be named.
const NO_PARTICLE: u32 = u32::MAX;

impl Figures {
    /// Takes the words of `measure_total.wgsl` apart.
    pub(crate) fn new(model: &Model, bytes: &[u8]) -> Self {
        let words: [u32; MEASURE_SIZE as usize / 4] =
            bytemuck::pod_read_unaligned(&bytes[..MEASURE_SIZE as usize]);
        let number = |at: usize| f64::from(f32::from_bits(words[at]));
        // Each sum is a pair of numbers, four words apart.
        let sum = |at: usize| number(at) + number(at + 4);
        let vector = |at: usize| [sum(at), sum(at + 1), sum(at + 2)];
        let length = |vector: [f64; 3]| vector.iter().map(|c| c * c).sum::<f64>().sqrt();
        let [strain_particle, non_finite, contacts] = [words[28], words[29], words[30]];
        // A triangle of fabric counts as the two ends of a spring.
        let ends = 2.0 * (model.springs().len() + model.elements().triangles().len()) as f64;
        let measures = Measures {
            non_finite_particle: (non_finite != NO_PARTICLE).then_some(non_finite),
            non_finite_step: None,
            // Still where it began: no strain was measured.
            strain_max: if number(24) > -1.0 { number(24) } else { 0.0 },
            strain_mean: sum(0) / ends.max(1.0),
            strain_particle: if strain_particle == NO_PARTICLE { 0 } else { strain_particle },
            penetration_max: number(25),
            energy_kinetic: sum(3),
            // Both ends of a spring count its energy k stretch^2 / 2.
            energy_elastic: 0.25 * sum(1),
            energy_potential: sum(11),
            momentum: vector(8),
            momentum_drift: length(vector(16)) / sum(2).max(f64::MIN_POSITIVE),
        };
        // Both particles of a pair count it.
        Self { measures, contacts: u64::from(contacts / 2) }
    }
}
