// Partners of particles that have more than a thread keeps.

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

// The partners of a particle, one after the other.
struct Partners {
    count: u32,
    // The next one in memory; NOWHERE if the thread keeps them.
    place: u32,
    kept: Kept,
}

// The partners of the particle of each thread, ascending. All threads of the workgroup take part.
fn partners_of(group: u32, lane: u32, particle: u32, position: vec3f) -> Partners {
    let found = contacts_search(group, lane, particle, position, NOWHERE);
    if workgroupUniformLoad(&is_more) == 0u {
        return Partners(found.count, NOWHERE, found.kept);
    }
    var place = NOWHERE;
    if found.count > KEPT {
        place = spill_allocate(found.count);
    }
    contacts_search(group, lane, particle, position, place);
    if place == NOWHERE {
        // Those that do not fit make the frame invalid.
        return Partners(min(found.count, KEPT), NOWHERE, found.kept);
    }
    sort_entries(place, found.count);
    return Partners(found.count, place, found.kept);
}

// Takes the next one.
fn partner_next(partners: ptr<function, Partners>) -> u32 {
    if (*partners).place == NOWHERE {
        let next = (*partners).kept.a.x;
        (*partners).kept = kept_rest((*partners).kept);
        return next;
    }
    (*partners).place += 1u;
    return contact_entries[(*partners).place - 1u];
}
