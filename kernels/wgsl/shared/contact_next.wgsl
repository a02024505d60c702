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
