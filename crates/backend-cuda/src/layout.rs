//! What kernels are given, as `kernels/cuda/shared/solver.cuh` lays it out.

use bytemuck::{Pod, Zeroable};
use cloth_core::Real;

/// Particles of a block of sums, as on the CPU.
pub(crate) const BLOCK: usize = 512;
/// Particles of a group: a warp.
pub(crate) const GROUP: usize = 32;

/// A precision of the device.
pub(crate) trait CudaReal: Real + Pod {
    /// Whether it is the double one.
    const DOUBLE: bool;
}

impl CudaReal for f32 {
    const DOUBLE: bool = false;
}

impl CudaReal for f64 {
    const DOUBLE: bool = true;
}

/// Four numbers, as kernels load them.
pub(crate) type Real4<T> = [T; 4];

/// One substep.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct SubstepData<T> {
    pub(crate) step: u64,
    pub(crate) collider_first: u32,
    pub(crate) tick: u32,
    pub(crate) length: T,
    pub(crate) wind: [T; 3],
    pub(crate) time: T,
    pub(crate) recovery: T,
}

/// A solid as signed distances.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct GridData<T> {
    pub(crate) distances: u64,
    pub(crate) size: [u32; 3],
    pub(crate) sets: u32,
    pub(crate) origin: [T; 3],
    pub(crate) spacing: T,
    pub(crate) inverse_spacing: T,
    pub(crate) last: [T; 3],
    pub(crate) rate: T,
    pub(crate) padding: T,
}

/// A collider at one time.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct ColliderData<T> {
    pub(crate) shape: u64,
    pub(crate) grid: u64,
    pub(crate) translation: [T; 3],
    pub(crate) linear_velocity: [T; 3],
    pub(crate) angular_velocity: [T; 3],
    pub(crate) rotation: [T; 9],
    pub(crate) size: [T; 3],
    pub(crate) friction: T,
    pub(crate) restitution: T,
    pub(crate) padding: T,
}

/// A change to one particle.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct PinData<T> {
    pub(crate) particle: u32,
    /// Bits: held, position given, velocity given.
    pub(crate) flags: u32,
    pub(crate) position: [T; 3],
    pub(crate) velocity: [T; 3],
}

/// A force on one particle.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct ControlForceData<T> {
    pub(crate) particle: u32,
    pub(crate) is_here: u32,
    pub(crate) force: [T; 3],
    pub(crate) anchor: [T; 3],
    pub(crate) stiffness: T,
    pub(crate) damping: T,
    pub(crate) reach: T,
    pub(crate) before: [T; 3],
}

/// What the host reads after a frame.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Status {
    pub(crate) barrier: [u64; 2],
    pub(crate) meetings: [u64; 2],
    pub(crate) non_finite_step: u64,
    pub(crate) contacts: u64,
    pub(crate) candidates: u64,
    pub(crate) overflow: u32,
    pub(crate) group_overflow: u32,
    pub(crate) rebuilds: u32,
    pub(crate) built: u32,
    pub(crate) stale: [u32; 4],
    pub(crate) large: u32,
    pub(crate) searched: [u32; 3],
    pub(crate) taken: [u32; 3],
    pub(crate) again: u32,
}

impl Status {
    /// Whether something did not fit.
    pub(crate) const fn overflowed(&self) -> bool {
        self.overflow > 0 || self.group_overflow > 0
    }
}

/// All memory of a solver: the first argument of every kernel.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct SolverData<T> {
    pub(crate) position: [u64; 3],
    pub(crate) velocity: [u64; 3],
    pub(crate) force: u64,
    pub(crate) kept_position: u64,
    pub(crate) kept_velocity: u64,
    pub(crate) start_position: u64,
    pub(crate) spring_row: u64,
    pub(crate) spring_headers: u64,
    pub(crate) spring_entries: u64,
    pub(crate) spring_packed: u64,
    pub(crate) spring_kinds: u64,
    pub(crate) spring_buckling: u64,
    pub(crate) offsets: u64,
    pub(crate) triangle_rows: u64,
    pub(crate) triangles: u64,
    pub(crate) air: u64,
    pub(crate) gas: u64,
    pub(crate) colliders: u64,
    pub(crate) substeps: u64,
    pub(crate) status: u64,
    pub(crate) dependency_rows: u64,
    pub(crate) dependencies: u64,
    pub(crate) progress: u64,
    pub(crate) candidates: u64,
    pub(crate) candidate_counts: u64,
    pub(crate) rest: u64,
    pub(crate) group_members: u64,
    pub(crate) group_positions: [u64; 2],
    pub(crate) group_boxes: [u64; 2],
    pub(crate) group_regions: u64,
    pub(crate) group_rows: u64,
    pub(crate) group_counts: u64,
    pub(crate) cell_heads: u64,
    pub(crate) cell_nodes: u64,
    pub(crate) crowd: u64,
    pub(crate) tile_boxes: u64,
    pub(crate) tile_flat: u64,
    pub(crate) tile_marks: u64,
    pub(crate) tile_list: u64,
    pub(crate) tile_rough: u64,
    pub(crate) limited_springs: u64,
    pub(crate) limited_rows: u64,
    pub(crate) longest: u64,
    pub(crate) stretch_triangles: u64,
    pub(crate) stretch_rows: u64,
    pub(crate) limit_regions: u64,
    pub(crate) limit_particles: u64,
    pub(crate) limit_rows: u64,
    pub(crate) limit_springs: u64,
    pub(crate) partials: u64,
    pub(crate) collider_impulses: u64,
    pub(crate) fabric_laws: u64,
    pub(crate) membranes: u64,
    pub(crate) plates: u64,
    pub(crate) membrane_forces: u64,
    pub(crate) bending_forces: u64,
    pub(crate) membrane_rows: u64,
    pub(crate) membrane_entries: u64,
    pub(crate) fold_particles: u64,
    pub(crate) fold_angles: u64,
    pub(crate) patch_folds: u64,
    pub(crate) fold_states: u64,
    pub(crate) fold_apexes: u64,
    pub(crate) fold_moments: u64,
    pub(crate) moment_places: u64,
    pub(crate) fold_rows: u64,
    pub(crate) fold_entries: u64,
    pub(crate) count: u32,
    pub(crate) header_count: u32,
    pub(crate) entry_count: u32,
    pub(crate) kind_count: u32,
    pub(crate) collider_count: u32,
    pub(crate) present: u32,
    pub(crate) can_buckle: u32,
    pub(crate) has_air: u32,
    pub(crate) group_count: u32,
    pub(crate) group_capacity: u32,
    pub(crate) cell_mask: u32,
    pub(crate) candidate_capacity: u32,
    pub(crate) contact: u32,
    pub(crate) chunk: u32,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    pub(crate) limit_region_count: u32,
    pub(crate) limit_colours: u32,
    pub(crate) limit_sweeps: u32,
    pub(crate) stretch_colours: u32,
    pub(crate) limit_particles_max: u32,
    pub(crate) limit_owned_max: u32,
    pub(crate) limit_springs_near: u32,
    pub(crate) element_count: u32,
    pub(crate) fold_count: u32,
    pub(crate) epoch: u64,
    pub(crate) acceleration: [T; 3],
    pub(crate) drag_rate: [T; 3],
    pub(crate) contact_distance: T,
    pub(crate) contact_stiffness: T,
    pub(crate) contact_damping: T,
    pub(crate) contact_restitution: T,
    pub(crate) contact_friction: T,
    pub(crate) list_margin: T,
    pub(crate) list_horizon: T,
    pub(crate) cells_per_metre: T,
    pub(crate) stencil: [[T; 3]; 6],
    pub(crate) stretch_ratio: T,
}

macro_rules! plain {
    ($($name:ident)*) => {$(
        // SAFETY: numbers alone, without padding in either precision (tested below).
        unsafe impl<T: CudaReal> Zeroable for $name<T> {}
        // SAFETY: as above.
        unsafe impl<T: CudaReal> Pod for $name<T> {}
    )*};
}

plain!(SubstepData GridData ColliderData PinData ControlForceData);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_copied_has_padding() {
        assert_eq!(size_of::<SubstepData<f32>>(), 8 + 8 + 6 * 4);
        assert_eq!(size_of::<SubstepData<f64>>(), 8 + 8 + 6 * 8);
        assert_eq!(size_of::<GridData<f32>>(), 8 + 16 + 10 * 4);
        assert_eq!(size_of::<GridData<f64>>(), 8 + 16 + 10 * 8);
        assert_eq!(size_of::<ColliderData<f32>>(), 16 + 24 * 4);
        assert_eq!(size_of::<ColliderData<f64>>(), 16 + 24 * 8);
        assert_eq!(size_of::<PinData<f32>>(), 8 + 6 * 4);
        assert_eq!(size_of::<PinData<f64>>(), 8 + 6 * 8);
        assert_eq!(size_of::<ControlForceData<f32>>(), 8 + 12 * 4);
        assert_eq!(size_of::<ControlForceData<f64>>(), 8 + 12 * 8);
    }

    /// The CUDA sources assert the same.
    #[test]
    fn kernels_are_given_as_many_bytes_as_they_take() {
        assert_eq!(size_of::<SolverData<f32>>(), 696 + 34 * 4);
        assert_eq!(size_of::<SolverData<f64>>(), 696 + 33 * 8);
    }
}
