//! How many workgroups a kernel needs, in two dimensions.

use cloth_core::{Error, Result};

/// Threads of a workgroup, one for each particle (`WORKGROUP` in `shared/model.wgsl`).
pub(crate) const WORKGROUP: u32 = 64;
/// Particles that a workgroup of the stage `measure` sums up.
pub(crate) const MEASURE_BLOCK: u32 = 1024;
/// Particles of a group, each in a workgroup of its own (`GROUP` in `shared/group.wgsl`).
pub(crate) const GROUP: u32 = 32;
/// Threads of a workgroup of the linear solvers (`SOLVE_THREADS` in `shared/solve.wgsl`).
const SOLVE_THREADS: u32 = 256;
/// Most partial sums of a linear solver (`PARTIALS_MAX` in `shared/solve.wgsl`).
pub(crate) const PARTIALS_MAX: u32 = 1024;
/// Particles around those of a workgroup that it keeps in an iteration of one kernel (`WINDOW` in
/// `conjugate_gradient_iteration.wgsl`).
const WINDOW: u32 = 1024;
/// Workgroup memory of that kernel \[byte\]: its window, sums, a phase.
const WINDOW_MEMORY: u32 = 12 * WINDOW + 8 * SOLVE_THREADS + 16;

/// Whether an iteration of the conjugate gradient method can be one kernel, on a device with `memory` bytes for each
/// workgroup, in a model whose springs join particles with numbers that differ by `reach` at most.
pub(crate) const fn iterates_at_once(particles: u32, reach: u32, memory: u32) -> bool {
    let [_, repeats] = solve_blocks(particles);
    repeats == 1 && reach <= (WINDOW - SOLVE_THREADS) / 2 && memory >= WINDOW_MEMORY
}

/// Workgroups of the linear solvers, and particles of each of their threads.
pub(crate) const fn solve_blocks(particles: u32) -> [u32; 2] {
    let repeats = particles.div_ceil(SOLVE_THREADS * PARTIALS_MAX);
    let repeats = if repeats == 0 { 1 } else { repeats };
    [particles.div_ceil(SOLVE_THREADS * repeats), repeats]
}

/// Workgroups along x and y.
pub(crate) type Groups = [u32; 2];

/// Enough workgroups for `items`, `per_group` each. One dimension holds at most `limit` of them; what
/// does not fit goes into rows of that length.
///
/// # Errors
/// `LimitExceeded` if two dimensions do not suffice.
pub(crate) fn groups(items: u32, per_group: u32, limit: u32) -> Result<Groups> {
    let needed = items.div_ceil(per_group).max(1);
    let x = needed.min(limit);
    let y = needed.div_ceil(x);
    if y > limit {
        return Err(Error::LimitExceeded {
            limit: "workgroups of a dispatch (max_compute_workgroups_per_dimension squared)",
            requested: u64::from(needed),
            max: u64::from(limit) * u64::from(limit),
        });
    }
    Ok([x, y])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partial_sums_fit_for_any_number_of_particles() {
        for particles in [1, 256, 257, 262_144, 262_145, 1 << 20, 50_000_000] {
            let [blocks, repeats] = solve_blocks(particles);
            assert!(blocks <= PARTIALS_MAX);
            assert!(u64::from(blocks) * u64::from(repeats) * 256 >= u64::from(particles));
        }
    }

    #[test]
    fn an_iteration_is_one_kernel_where_its_window_suffices() {
        let patch = |side: u32| iterates_at_once(side * side, 2 * side + 2, 16 << 10);
        assert!(patch(60) && patch(190) && !patch(192));
        assert!(!iterates_at_once(3600, 122, 8 << 10));
        assert!(!iterates_at_once(1 << 20, 2, 16 << 10));
    }

    #[test]
    fn rows_hold_all_items() {
        assert_eq!(groups(1, 64, 65_535), Ok([1, 1]));
        assert_eq!(groups(64 * 65_535, 64, 65_535), Ok([65_535, 1]));
        assert_eq!(groups(64 * 65_535 + 1, 64, 65_535), Ok([65_535, 2]));
        assert_eq!(groups(640, 64, 4), Ok([4, 3]));
        assert!(matches!(
            groups(64 * 17, 64, 4),
            Err(Error::LimitExceeded { requested: 17, max: 16, .. })
        ));
    }
}
