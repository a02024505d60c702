//! How many workgroups a kernel needs, in two dimensions.

use cloth_core::{Error, Result};

/// Threads of a workgroup, one for each particle (`WORKGROUP` in `shared/model.wgsl`).
pub(crate) const WORKGROUP: u32 = 64;
/// Particles that a workgroup of the stage `measure` sums up.
pub(crate) const MEASURE_BLOCK: u32 = 1024;
/// Cells that a workgroup of `contact_candidates_scan` goes through.
pub(crate) const SCAN_BLOCK: u32 = 1024;

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
