// NUMERICS section 8, first pass: the box around each group, and whether it stays in its region.
//!include model substep status motion group contact_turn group_box group_boxes_out group_rows group_region group_check

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let group = group_index(workgroup, groups);
    if group >= contact.group_count {
        return;
    }
    if group == 0u && lane == 0u {
        atomicStore(&status.contact_spilled[0], 0u);
        atomicStore(&status.contact_spilled[1], 0u);
    }
    let member = group_members[group * GROUP + lane];
    // Threads without a particle do what the first one does.
    let particle = select(member, group_members[group * GROUP], member == NONE);
    let position = position_in[particle].xyz;
    group_check(group, lane, position, velocity_in[particle].xyz, substep.contact_tick);
}
