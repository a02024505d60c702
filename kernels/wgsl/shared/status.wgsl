// What the device decides for itself, and the host reads after a frame.

struct Status {
    // Serial number of the substep that left a number that is not finite; STOPPED_NEVER before.
    stopped: atomic<u32>,
    // Sum of the INVALID_ constants: why the contacts of this frame cannot be trusted.
    invalid: atomic<u32>,
    // Contact tick of the last use of the candidate list that found it close to its end.
    contact_stale: atomic<u32>,
    // Contact tick that is building the list, or built it last.
    contact_building: u32,
    // Contact tick at which the list was built; 0 if there is none.
    contact_built: u32,
    // Time at which the list was built [s].
    contact_built_time: f32,
    // Candidates of all particles, even if there is no room for them.
    contact_entries: atomic<u32>,
    // Times the list was built.
    contact_rebuilds: u32,
    // Particles put into cells so far.
    cell_particles: atomic<u32>,
    // Room that the largest candidate list so far needed [entries], noted if it did not fit.
    contact_needed: atomic<u32>,
    // Serial number of the substep whose linear solve broke down; STOPPED_NEVER before.
    broken: atomic<u32>,
    // Entries of rows that are longer than others, behind all rows.
    contact_spilled: atomic<u32>,
}

@group(0) @binding(2) var<storage, read_write> status: Status;

const STOPPED_NEVER: u32 = 0xffffffffu;
// A list was used beyond its proof of completeness.
const INVALID_LIST: u32 = 1u;
// The candidates did not fit into their buffer.
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
