//! What kernels of the linear system are given, as `shared/linear.cuh` lays it out.

use bytemuck::{Pod, Zeroable};

use crate::triangle_contact::ContactTable;

/// What a solver of linear systems did.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Outcome {
    pub(crate) residual: f64,
    /// Not a number where there is no estimate.
    pub(crate) energy: f64,
    pub(crate) iterations: u32,
    pub(crate) converged: u32,
    pub(crate) breakdown: u32,
    pub(crate) changed: u32,
    pub(crate) constrained: u32,
    pub(crate) indefinite: u32,
}

/// The second argument of every kernel of the linear system.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct LinearData<T> {
    pub(crate) roots: u64,
    pub(crate) along: u64,
    pub(crate) origin: u64,
    pub(crate) links: u64,
    pub(crate) base: [u64; 2],
    pub(crate) diagonal: [u64; 2],
    pub(crate) inverse: [u64; 2],
    pub(crate) vectors: [u64; 7],
    pub(crate) constraints: u64,
    pub(crate) touch_counts: u64,
    pub(crate) filter: [u64; 2],
    pub(crate) target: u64,
    pub(crate) pair_partners: u64,
    pub(crate) pair_factors: u64,
    pub(crate) pair_counts: u64,
    pub(crate) outcome: u64,
    pub(crate) partials: u64,
    pub(crate) membrane_tangents: u64,
    pub(crate) fold_stiffness: u64,
    pub(crate) fold_tangents: u64,
    pub(crate) element_sums: u64,
    pub(crate) term_offsets: u64,
    pub(crate) terms: u64,
    pub(crate) element_slices: u64,
    pub(crate) element_columns: u64,
    pub(crate) element_blocks: u64,
    pub(crate) contacts: ContactTable,
    pub(crate) schwarz: u64,
    pub(crate) slot_count: u32,
    pub(crate) is_full: u32,
    pub(crate) has_constraints: u32,
    pub(crate) has_pairs: u32,
    pub(crate) has_blocks: u32,
    pub(crate) has_elements: u32,
    pub(crate) has_contacts: u32,
    pub(crate) length: T,
    pub(crate) pair_share: T,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The CUDA sources assert the same.
    #[test]
    fn kernels_are_given_as_many_bytes_as_they_take() {
        assert_eq!(size_of::<LinearData<f32>>(), 384);
        assert_eq!(size_of::<LinearData<f64>>(), 392);
    }
}
