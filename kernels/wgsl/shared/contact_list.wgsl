// NUMERICS section 8: the candidate list and the proof that it is complete.
//
// When the list is built, particle i is at r_i and is expected to move as
//
//     p_i(t) = r_i + t (u + q_i),     0 <= t <= horizon,
//
// with u the drift of everything and q_i its own velocity relative to that, in eight bits for each
// axis. The list holds each pair of particles that come closer than d + 2 a on these straight lines,
// looked for among all pairs closer than the size c of a cell. No pair in contact is missing as long
// as, for every particle, |x_i - p_i(t)| <= a and |x_i - r_i - t u| <= (c - d) / 2: a pair that was
// not looked at had a gap of more than c - d. Whoever uses the list checks that for its own particle.

struct Contact {
    // u [m/s].
    drift: vec3f,
    // Largest q on each axis [m/s].
    velocity_max: f32,
    // a [m].
    allowance: f32,
    // (c - d) / 2, less rounding [m].
    reach: f32,
    // [s].
    horizon: f32,
    // 1 / c [1/m].
    cells_per_metre: f32,
    // d + 2 a [m].
    list_distance: f32,
    // Number of cells in the table, a power of two, less one.
    cell_mask: u32,
    // Entries that the candidate list has room for.
    list_capacity: u32,
    // Time from one opportunity to build the list to the next [s].
    lead: f32,
}

@group(0) @binding(15) var<uniform> contact: Contact;
// Bits of r_i, and q_i as four signed bytes.
@group(0) @binding(16) var<storage, read_write> contact_reference: array<vec4<u32>>;

// Rounding of coordinates, for both particles of a pair, relative to the largest coordinate.
const ROUNDING: f32 = 4e-6;

fn contact_velocity(packed: u32) -> vec3f {
    return contact.velocity_max * unpack4x8snorm(packed).xyz;
}

// How a particle that is at `position` now has moved since the list was built.
struct Progress {
    elapsed: f32,
    // Square of the distance relative to the drift, and of that to its expected place [m^2].
    used: vec2f,
}

fn contact_progress(particle: u32, position: vec3f) -> Progress {
    let elapsed = substep.time - status.contact_built_time;
    let reference = contact_reference[particle];
    let moved = (position - bitcast<vec3f>(reference.xyz)) - elapsed * contact.drift;
    let strayed = moved - elapsed * contact_velocity(reference.w);
    return Progress(elapsed, vec2f(dot_product(moved, moved), dot_product(strayed, strayed)));
}

// Whether the list is complete as far as this particle can tell.
fn contact_list_holds(progress: Progress) -> bool {
    let allowed = vec2f(contact.reach, contact.allowance);
    // Written so that a NaN counts as too far.
    return all(progress.used <= allowed * allowed) && progress.elapsed >= 0.0
        && progress.elapsed <= contact.horizon && status.contact_built != 0u;
}

// Whether it will still be complete when the opportunity after the next one comes, if displacements
// grow with time and ways bend with its square.
fn contact_list_will_hold(progress: Progress) -> bool {
    let growth = (progress.elapsed + contact.lead) / max(progress.elapsed, 1e-12);
    let grown = progress.used * vec2f(growth * growth, growth * growth * growth * growth);
    return contact_list_holds(Progress(progress.elapsed, grown));
}

// Called by whoever uses the list, for each particle: marks the frame as invalid if the list is not
// complete, and the list as stale if it soon may not be.
fn contact_list_verify(particle: u32, position: vec3f) {
    let progress = contact_progress(particle, position);
    if progress.elapsed != 0.0 && !contact_list_will_hold(progress) {
        atomicMax(&status.contact_stale, substep.contact_tick);
    }
    if !contact_list_holds(progress) {
        atomicOr(&status.invalid, INVALID_LIST);
    }
}

// Whether the list is to be built now. Nothing that this reads changes until it is being built.
fn contact_list_is_wanted() -> bool {
    let forced = (substep.flags & FLAG_CONTACT_REBUILD) != 0u;
    let stale = atomicLoad(&status.contact_stale) > status.contact_built;
    let age = substep.time - status.contact_built_time;
    let ends = !(age >= 0.0 && age <= 0.5 * contact.horizon);
    return !is_stopped() && (forced || stale || ends || status.contact_built == 0u);
}

// Whether it is being built in this call of the stage.
fn contact_list_is_being_built() -> bool {
    return status.contact_building == substep.contact_tick;
}
