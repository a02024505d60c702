//! Sizes of the form for one patch of few tiles that is in contact with itself.

use crate::layout::{GROUP, Real4};

/// Groups of a tile, particles that a block has in shared memory, those that are compared, pairs, and partners that there is room for, as
/// in `patch/area.cuh` and `patch/area_view.cuh`.
pub(crate) const CONTACT_GROUPS: usize = 8;
const CONTACT_ENTRIES: usize = 48 * 16 + CONTACT_GROUPS * 64;
const CONTACT_MEMBERS: usize = CONTACT_GROUPS * 16 * GROUP;
const CONTACT_PAIRS: usize = CONTACT_MEMBERS / 2;
const CONTACT_PARTNERS: usize = (15 + 16) * 256;
/// Particles that the form with contact can name, and bytes of shared memory that it has beside those that depend on the model, at most.
pub(crate) const CONTACT_PARTICLES_MAX: usize = 1 << 16;
pub(crate) const CONTACT_STATIC: usize = 8704;
/// Numbers of the springs of a tile, as in `stencil.cuh`.
pub(crate) const STENCIL_FORCES: usize = 53 * 37 * 3;
const _: () = assert!(
    contact_shared_bytes::<f32>(800) + CONTACT_STATIC <= 163 << 10,
    "a block of compute capability 8.0 has no room for the common workload of 160 x 160 any more",
);

/// Bytes of shared memory of a block of `explicit_substep_contact.cu` for a patch of so many groups.
pub(crate) const fn contact_shared_bytes<T>(groups: usize) -> usize {
    let particles = 2 * CONTACT_ENTRIES + CONTACT_PAIRS;
    let names = CONTACT_MEMBERS + CONTACT_PARTNERS;
    let lists = CONTACT_GROUPS * groups * size_of::<u16>();
    particles * size_of::<Real4<T>>()
        + names * size_of::<u32>()
        + lists
        + STENCIL_FORCES * size_of::<T>()
}
