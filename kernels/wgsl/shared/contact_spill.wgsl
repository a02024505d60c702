// Partners of particles that have more than a thread keeps.

// Partners that are kept. For a particle that has more all are searched for again.
const KEPT: u32 = 16u;
// No place in memory.
const NOWHERE: u32 = 0xffffffffu;

// What all particles have room for lies first (`contact_candidates_list`), then rows of any length in any order.
@group(0) @binding(18) var<storage, read_write> contact_entries: array<u32>;

// A place for a row of `count` entries behind all others, or NOWHERE. Two counters take turns; boxes and the fused
// substep clear the one that is not in use.
fn spill_allocate(count: u32) -> u32 {
    let first = model.particle_count * KEPT + atomicAdd(&status.contact_spilled[substep.contact_tick & 1u], count);
    if first + count > contact.entries_capacity {
        // After an earlier substep has stopped the device nothing depends on it.
        if atomicLoad(&status.stopped) >= substep.serial {
            atomicOr(&status.invalid, INVALID_OVERFLOW);
            atomicMax(&status.contact_needed, first + count);
        }
        return NOWHERE;
    }
    return first;
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
