// NUMERICS section 8, building the candidate list, last pass: each particle looks through 27 cells. Several
// threads share a particle: where cloth is crumpled, cells are full.
//!include model substep status contact_list cells

@group(0) @binding(26) var<storage, read> cell_ranges: array<vec2<u32>>;
@group(0) @binding(27) var<storage, read> sorted_positions: array<vec4<u32>>;
@group(0) @binding(28) var<storage, read> sorted_velocities: array<u32>;
@group(0) @binding(17) var<storage, read_write> contact_rows: array<vec2<u32>>;
@group(0) @binding(18) var<storage, read_write> contact_entries: array<u32>;
//!if exclusions
// Partners that the response leaves out: n + 1 offsets, then the rows, ascending.
@group(0) @binding(29) var<storage, read> exclusions: array<u32>;

fn is_left_out(particle: u32, partner: u32) -> bool {
    var low = exclusions[particle];
    var high = exclusions[particle + 1u];
    while low < high {
        let middle = (low + high) / 2u;
        let found = exclusions[model.particle_count + 1u + middle];
        if found == partner {
            return true;
        }
        if found < partner {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return false;
}
//!end

// Square of the smallest distance of two particles within the horizon, on their expected ways.
fn closest_squared(difference: vec3f, relative: vec3f) -> f32 {
    let speed_squared = max(dot_product(relative, relative), 1e-30);
    let time = clamp(-dot_product(difference, relative) / speed_squared, 0.0, contact.horizon);
    let closest = add_scaled(difference, time, relative);
    return dot_product(closest, closest);
}

struct Search {
    particle: u32,
    position: vec3f,
    velocity: vec3f,
    distance_squared: f32,
}

fn is_candidate(search: Search, cell: vec3<i32>, sorted: vec4<u32>, packed: u32) -> bool {
    let partner = sorted.w;
    let position = bitcast<vec3f>(sorted.xyz);
    let relative = contact_velocity(packed) - search.velocity;
    let difference = position - search.position;
    if partner == search.particle || closest_squared(difference, relative) >= search.distance_squared {
        return false;
    }
    // Another cell can have the same place in the table; its particles are found from there.
    if any(cell_of(position) != cell) {
        return false;
    }
//!if exclusions
    if is_left_out(search.particle, partner) {
        return false;
    }
//!end
    return true;
}

// Threads of a particle, and particles of a workgroup.
const LANES: u32 = 8u;
const PARTICLES: u32 = WORKGROUP / LANES;
// Candidates that are kept while the search goes on; a particle that has more searches again.
const KEPT: u32 = 64u;

var<workgroup> kept: array<u32, PARTICLES * KEPT>;
var<workgroup> counts: array<atomic<u32>, PARTICLES>;
var<workgroup> firsts: array<u32, PARTICLES>;

fn cell_around(centre: vec3<i32>, k: i32) -> vec3<i32> {
    return centre + vec3<i32>(k % 3 - 1, (k / 3) % 3 - 1, k / 9 - 1);
}

// Keeps the candidates that one of the threads of a particle finds, in any order.
fn search_shared(search: Search, local: u32, lane: u32) {
    let centre = cell_of(search.position);
    for (var k = 0; k < 27; k += 1) {
        let cell = cell_around(centre, k);
        let range = cell_ranges[cell_place(cell)];
        for (var place = range.x + lane; place < range.y; place += LANES) {
            let sorted = sorted_positions[place];
            if is_candidate(search, cell, sorted, sorted_velocities[place]) {
                let at = atomicAdd(&counts[local], 1u);
                if at < KEPT {
                    kept[local * KEPT + at] = sorted.w;
                }
            }
        }
    }
}

// Writes all candidates from place `first` on, in any order: one thread alone.
fn search_alone(search: Search, first: u32) {
    let centre = cell_of(search.position);
    var count = 0u;
    for (var k = 0; k < 27; k += 1) {
        let cell = cell_around(centre, k);
        let range = cell_ranges[cell_place(cell)];
        for (var place = range.x; place < range.y; place += 1u) {
            let sorted = sorted_positions[place];
            if is_candidate(search, cell, sorted, sorted_velocities[place]) {
                contact_entries[first + count] = sorted.w;
                count += 1u;
            }
        }
    }
}

// Lets the entry at `root` of a heap of `count` entries sink to its place.
fn sift_down(first: u32, root: u32, count: u32) {
    var parent = root;
    let value = contact_entries[first + parent];
    loop {
        var child = 2u * parent + 1u;
        if child >= count {
            break;
        }
        if child + 1u < count && contact_entries[first + child] < contact_entries[first + child + 1u] {
            child += 1u;
        }
        let larger = contact_entries[first + child];
        if larger <= value {
            break;
        }
        contact_entries[first + parent] = larger;
        parent = child;
    }
    contact_entries[first + parent] = value;
}

// Williams (1964), "Algorithm 232: Heapsort".
fn sort_entries(first: u32, count: u32) {
    for (var root = count / 2u; root > 0u; root -= 1u) {
        sift_down(first, root - 1u, count);
    }
    for (var last = count; last > 1u; last -= 1u) {
        let largest = contact_entries[first];
        contact_entries[first] = contact_entries[first + last - 1u];
        contact_entries[first + last - 1u] = largest;
        sift_down(first, 0u, last - 1u);
    }
}

// Every particle has a row of this many places. Longer ones lie behind all rows, in any order.
const ROW: u32 = 16u;

// No room for a row.
const NOWHERE: u32 = 0xffffffffu;

// The place of a row of `count` entries.
fn row_allocate(particle: u32, count: u32) -> u32 {
    var first = particle * ROW;
    if count > ROW {
        first = model.particle_count * ROW + atomicAdd(&status.contact_spilled, count);
    }
    if first + count > contact.list_capacity {
        atomicOr(&status.invalid, INVALID_OVERFLOW);
        atomicMax(&status.contact_needed, first + count);
        contact_rows[particle] = vec2<u32>(0u, 0u);
        return NOWHERE;
    }
    contact_rows[particle] = vec2<u32>(first, count);
    return first;
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let local = thread / LANES;
    let lane = thread % LANES;
    let particle = (workgroup.x + workgroup.y * groups.x) * PARTICLES + local;
    let is_active = particle < model.particle_count && contact_list_is_being_built();
    if thread < PARTICLES {
        atomicStore(&counts[thread], 0u);
    }
    workgroupBarrier();
    var search: Search;
    if is_active {
        let reference = contact_reference[particle];
        let position = bitcast<vec3f>(reference.xyz);
        let extent = max(max(abs(position.x), abs(position.y)), abs(position.z));
        let distance = contact.list_distance + ROUNDING * extent;
        search = Search(particle, position, contact_velocity(reference.w), distance * distance);
        search_shared(search, local, lane);
    }
    workgroupBarrier();
    let count = atomicLoad(&counts[local]);
    if is_active && lane == 0u {
        firsts[local] = row_allocate(particle, count);
    }
    workgroupBarrier();
    let first = firsts[local];
    if is_active && first != NOWHERE {
        if count <= KEPT {
            // The place of a candidate is the number of smaller ones.
            for (var k = lane; k < count; k += LANES) {
                let partner = kept[local * KEPT + k];
                var place = first;
                for (var other = 0u; other < count; other += 1u) {
                    place += select(0u, 1u, kept[local * KEPT + other] < partner);
                }
                contact_entries[place] = partner;
            }
        } else if lane == 0u {
            search_alone(search, first);
            sort_entries(first, count);
        }
    }
    if thread == 0u {
        var listed = 0u;
        for (var k = 0u; k < PARTICLES; k += 1u) {
            listed += atomicLoad(&counts[k]);
        }
        if listed > 0u {
            atomicAdd(&status.contact_entries, listed);
        }
    }
}
