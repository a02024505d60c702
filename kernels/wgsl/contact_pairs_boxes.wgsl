// NUMERICS section 15, contact_groups: boxes around triangles at both sets of positions, and around their groups.
//!include model pair_task pair_ways pair_references pair_box pair_way_box surface pair_boxes

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let group = particle_index(id, groups);
    if group >= pair_task.group_count {
        return;
    }
    var around = ways_none();
    for (var slot = SLOTS * group; slot < SLOTS * (group + 1u); slot += 1u) {
        if triangle_word(slot, 0u) == NO_TRIANGLE {
            break;
        }
        let corners = triangle_corners(slot);
        var bounds = ways_none();
        for (var k = 0u; k < 3u; k += 1u) {
            bounds = ways_with(bounds, corners[k]);
        }
        stored_box_set(slot, bounds);
        around = ways_union(around, bounds);
    }
    stored_box_set(node_place(pair_task.group_count + group), around);
}
