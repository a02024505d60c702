// NUMERICS section 8, building the candidate list, last pass: each particle looks through 27 cells.
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

// Candidates that a thread keeps sorted while it searches; a particle that has more searches again.
const KEPT: u32 = 24u;
var<private> kept: array<u32, KEPT>;

// Puts a candidate in its place among `count` kept ones.
fn keep(partner: u32, count: u32) {
    if count >= KEPT {
        return;
    }
    var place = count;
    while place > 0u && kept[place - 1u] > partner {
        kept[place] = kept[place - 1u];
        place -= 1u;
    }
    kept[place] = partner;
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

// Looks through the particles of one cell. The candidates are kept, or written from place `first` on if it is
// not NOWHERE. Says how many there are, those before included.
const NOWHERE: u32 = 0xffffffffu;

fn search_cell(search: Search, cell: vec3<i32>, first: u32, before: u32) -> u32 {
    let range = cell_ranges[cell_place(cell)];
    var count = before;
    // Two at a time, so that the device waits once for what they read.
    for (var place = range.x; place < range.y; place += 2u) {
        let next = min(place + 1u, range.y - 1u);
        let sorted = sorted_positions[place];
        let sorted_next = sorted_positions[next];
        let packed = sorted_velocities[place];
        let packed_next = sorted_velocities[next];
        if is_candidate(search, cell, sorted, packed) {
            if first == NOWHERE {
                keep(sorted.w, count);
            } else {
                contact_entries[first + count] = sorted.w;
            }
            count += 1u;
        }
        if next > place && is_candidate(search, cell, sorted_next, packed_next) {
            if first == NOWHERE {
                keep(sorted_next.w, count);
            } else {
                contact_entries[first + count] = sorted_next.w;
            }
            count += 1u;
        }
    }
    return count;
}

fn search_all(search: Search, first: u32) -> u32 {
    let centre = cell_of(search.position);
    var count = 0u;
    for (var k = 0; k < 27; k += 1) {
        let cell = centre + vec3<i32>(k % 3 - 1, (k / 3) % 3 - 1, k / 9 - 1);
        count = search_cell(search, cell, first, count);
    }
    return count;
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

// Builds the row of a particle; says how many candidates it has.
fn list(particle: u32) -> u32 {
    let reference = contact_reference[particle];
    let position = bitcast<vec3f>(reference.xyz);
    let extent = max(max(abs(position.x), abs(position.y)), abs(position.z));
    let distance = contact.list_distance + ROUNDING * extent;
    let velocity = contact_velocity(reference.w);
    let search = Search(particle, position, velocity, distance * distance);
    let count = search_all(search, NOWHERE);
    var first = particle * ROW;
    if count > ROW {
        first = model.particle_count * ROW + atomicAdd(&status.contact_spilled, count);
    }
    if first + count > contact.list_capacity {
        atomicOr(&status.invalid, INVALID_OVERFLOW);
        atomicMax(&status.contact_needed, first + count);
        contact_rows[particle] = vec2<u32>(0u, 0u);
        return count;
    }
    if count <= KEPT {
        for (var k = 0u; k < count; k += 1u) {
            contact_entries[first + k] = kept[k];
        }
    } else {
        search_all(search, first);
        sort_entries(first, count);
    }
    contact_rows[particle] = vec2<u32>(first, count);
    return count;
}

var<workgroup> listed: atomic<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let particle = particle_index(id, groups);
    if particle < model.particle_count && contact_list_is_being_built() {
        atomicAdd(&listed, list(particle));
    }
    workgroupBarrier();
    if thread == 0u && atomicLoad(&listed) > 0u {
        atomicAdd(&status.contact_entries, atomicLoad(&listed));
    }
}
