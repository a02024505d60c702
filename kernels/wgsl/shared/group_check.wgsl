// Whether a group stays in its region.

// Whether all of a group, in the box that was kept, is within a region. What is not a number counts as outside.
fn region_holds(region: Box, box: Box) -> bool {
    return box_holds(region, box.low) && box_holds(region, box.high);
}

// Marks the list as stale from use `tick` on if a particle has left the region, or may do so before there is an
// opportunity to build the list. `position` and `velocity` are those of the particle of this thread.
fn region_check(region: Box, position: vec3f, velocity: vec3f, tick: u32) {
    let later = add_scaled(position, contact.lead, velocity);
    // Written so that what is not a number counts as outside.
    if !(box_holds(region, position) && box_holds(region, later)) && atomicLoad(&status.contact_stale) < tick {
        atomicMax(&status.contact_stale, tick);
    }
}

// The same for a group, and keeps the box around its present positions.
fn group_check(group: u32, lane: u32, position: vec3f, velocity: vec3f, tick: u32) {
    region_check(group_region(group), position, velocity, tick);
    box_keep(group, lane, position);
}
