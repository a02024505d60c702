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

// Looks through the particles of one cell, and writes the candidates from place `first` on if it is
// not NOWHERE. Says how many there are.
const NOWHERE: u32 = 0xffffffffu;

fn search_cell(search: Search, cell: vec3<i32>, first: u32) -> u32 {
    let range = cell_ranges[cell_place(cell)];
    var count = 0u;
    for (var place = range.x; place < range.y; place += 1u) {
        let sorted = sorted_positions[place];
        let partner = sorted.w;
        let position = bitcast<vec3f>(sorted.xyz);
        if partner == search.particle {
            continue;
        }
        let relative = contact_velocity(sorted_velocities[place]) - search.velocity;
        let difference = position - search.position;
        if closest_squared(difference, relative) >= search.distance_squared {
            continue;
        }
        // Another cell can have the same place in the table; its particles are found from there.
        if any(cell_of(position) != cell) {
            continue;
        }
//!if exclusions
        if is_left_out(search.particle, partner) {
            continue;
        }
//!end
        if first != NOWHERE {
            contact_entries[first + count] = partner;
        }
        count += 1u;
    }
    return count;
}

fn search_all(search: Search, first: u32) -> u32 {
    let centre = cell_of(search.position);
    var count = 0u;
    for (var k = 0; k < 27; k += 1) {
        let cell = centre + vec3<i32>(k % 3 - 1, (k / 3) % 3 - 1, k / 9 - 1);
        var place = NOWHERE;
        if first != NOWHERE {
            place = first + count;
        }
        count += search_cell(search, cell, place);
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

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || !contact_list_is_being_built() {
        return;
    }
    let reference = contact_reference[particle];
    let position = bitcast<vec3f>(reference.xyz);
    let extent = max(max(abs(position.x), abs(position.y)), abs(position.z));
    let distance = contact.list_distance + ROUNDING * extent;
    let velocity = contact_velocity(reference.w);
    let search = Search(particle, position, velocity, distance * distance);
    let count = search_all(search, NOWHERE);
    let first = atomicAdd(&status.contact_entries, count);
    if first + count > contact.list_capacity {
        atomicOr(&status.invalid, INVALID_OVERFLOW);
        atomicMax(&status.contact_needed, first + count);
        contact_rows[particle] = vec2<u32>(0u, 0u);
        return;
    }
    search_all(search, first);
    sort_entries(first, count);
    contact_rows[particle] = vec2<u32>(first, count);
}
