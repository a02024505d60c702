// NUMERICS section 8: groups of 32 particles that lie near each other at rest, and the boxes they are in.
//
// A workgroup takes a group, a thread a particle. When the list is built each group is given a region that it is
// expected to stay in for a while. Its row names the groups whose regions come within the contact distance of its
// own. As long as all groups are within their regions, no pair in contact is in groups that rows do not name.

struct Contact {
    group_count: u32,
    // Groups that a row has room for, a multiple of four.
    group_capacity: u32,
    // Number of cells in the table, a power of two, less one.
    cell_mask: u32,
    // Entries that the rows of all particles have room for.
    entries_capacity: u32,
    // What is added to a region on all sides [m].
    margin: f32,
    // Time that regions are made for [s].
    horizon: f32,
    // Time within which there is an opportunity to build the list [s].
    lead: f32,
    cells_per_metre: f32,
}

@group(0) @binding(15) var<uniform> contact: Contact;
// The particles of each group, at least one; NONE where there is none.
@group(0) @binding(16) var<storage, read> group_members: array<u32>;

const GROUP: u32 = 32u;
const NONE: u32 = 0xffffffffu;

// Words of four numbers before the entries of a row: low corner of the region and number of entries, high corner.
const ROW_HEADER: u32 = 2u;

fn group_row(group: u32) -> u32 {
    return group * (ROW_HEADER + contact.group_capacity / 4u);
}

struct Box {
    low: vec3f,
    high: vec3f,
}

// Larger by this much on all sides.
fn box_grown(box: Box, by: vec3f) -> Box {
    return Box(box.low - by, box.high + by);
}

fn box_holds(box: Box, position: vec3f) -> bool {
    return all(position >= box.low) && all(position <= box.high);
}

fn boxes_meet(a: Box, b: Box) -> bool {
    return all(a.low <= b.high) && all(b.low <= a.high);
}

// How far to look for contact around a box [m]: the distance, and what rounding may take away.
fn contact_reach(box: Box) -> vec3f {
    let extent = max(abs(box.low), abs(box.high));
    return vec3f(fma(4e-6, max(max(extent.x, extent.y), extent.z), 1.001 * model.contact_distance));
}

fn group_index(workgroup: vec3<u32>, groups: vec3<u32>) -> u32 {
    return workgroup.x + workgroup.y * groups.x;
}
