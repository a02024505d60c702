// Whether a group stays in its region.

// The boxes of all groups at the positions that are written, two corners each.
@group(0) @binding(25) var<storage, read_write> group_boxes_out: array<vec4f>;

// Whether all of a group, in the box that was kept, is within its region. What is not a number counts as outside.
fn group_holds(group: u32, box: Box) -> bool {
    let region = group_region(group);
    return box_holds(region, box.low) && box_holds(region, box.high);
}

// Keeps the box around the present positions of a group, and marks the list as stale from use `tick` on if a
// particle has left the region, or may do so before there is an opportunity to build the list. `position` and
// `velocity` are those of the particle of this thread.
fn group_check(group: u32, lane: u32, position: vec3f, velocity: vec3f, tick: u32) {
    let region = group_region(group);
    let later = add_scaled(position, contact.lead, velocity);
    // Written so that what is not a number counts as outside.
    if !(box_holds(region, position) && box_holds(region, later)) && atomicLoad(&status.contact_stale) < tick {
        atomicMax(&status.contact_stale, tick);
    }
    let box = group_box(lane, position);
    if lane < 2u {
        group_boxes_out[2u * group + lane] = vec4f(select(box.high, box.low, lane == 0u), 0.0);
    }
}
