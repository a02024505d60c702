// What the device decides for itself, and the host reads after a frame.

struct Status {
    // Serial number of the substep that left a number that is not finite; STOPPED_NEVER before.
    stopped: atomic<u32>,
    // Sum of the INVALID_ constants: why the contacts of this frame cannot be trusted.
    invalid: atomic<u32>,
    // Contact tick from which on the list of groups may not be complete.
    contact_stale: atomic<u32>,
    // Contact tick at which the list was built; 0 if there is none.
    contact_built: atomic<u32>,
    // Times the list was built.
    contact_rebuilds: u32,
    // The one of two tables of cells that the list is built with.
    contact_table: u32,
    // Contact tick at which some region touched more cells than are noted.
    contact_large: atomic<u32>,
    // Entries of the rows of all groups, even if there is no room for them.
    contact_listed: atomic<u32>,
    // Largest number of entries of a row of a group, noted if they did not fit.
    contact_group_needed: atomic<u32>,
    // Room that the rows of particles needed [entries], noted if it was not there.
    contact_needed: atomic<u32>,
    // Entries of rows of particles that are longer than others, behind all rows; two counters.
    contact_spilled: array<atomic<u32>, 2>,
    // Serial number of the substep whose linear solve broke down; STOPPED_NEVER before.
    broken: atomic<u32>,
}

@group(0) @binding(2) var<storage, read_write> status: Status;

const STOPPED_NEVER: u32 = 0xffffffffu;
// A group was outside its region when the list was used.
const INVALID_LIST: u32 = 1u;
// The rows of groups or of particles did not fit.
const INVALID_OVERFLOW: u32 = 2u;
// More iterations of a linear solver are needed than were recorded.
const INVALID_ITERATIONS: u32 = 4u;
// More solves of a substep are needed than were recorded.
const INVALID_PASSES: u32 = 8u;

// Whether an earlier substep, or an earlier stage of this one, met a number that is not finite or could not
// be solved: all stages then stand still.
fn is_stopped() -> bool {
    return min(atomicLoad(&status.stopped), atomicLoad(&status.broken)) != STOPPED_NEVER;
}
