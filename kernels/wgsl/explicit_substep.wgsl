// The composite stage: all forces, integration and, where nothing comes between, colliders, in one
// pass over the particles.
//!include model substep status motion motion_out finite field spring spring_batch integrate collider procedural
//!if grids
//!include distance_grid
//!end
//!if not grids
//!include distance_grid_none
//!end
//!if feedback
//!include feedback
//!end
//!if not feedback
//!include feedback_none
//!end
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end
//!if air
//!include triangles air air_add
//!end
//!if not air
//!include air_add_none
//!end
//!if fabric
//!include fabric_gather fabric_add
//!end
//!if not fabric
//!include fabric_add_none
//!end
//!include particle_force particle_advance
//!if penalty
//!include contact_pair contact_counts contact_penalty group contact_turn group_box group_boxes group_rows group_region
//!include contact_exclusions_none contact_kept contact_search contact_spill contact_next contact_force
//!include group_boxes_out group_check
//!end

//!if not penalty
@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count {
        return;
    }
    let position = position_in[particle];
    let velocity = velocity_in[particle];
    particle_advance(particle, position, velocity, particle_force(particle, position, velocity), is_over());
}
//!end
//!if penalty
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
    let member = group_members[group * GROUP + lane];
    let exists = member != NONE;
    // Threads without a particle look at the first one, and store nothing.
    let particle = select(group_members[group * GROUP], member, exists);
    let position = position_in[particle];
    let velocity = velocity_in[particle];
    let is_over = is_over();
    if group == 0u && lane == 0u {
        atomicStore(&status.contact_spilled[1u - (substep.contact_tick & 1u)], 0u);
    }
    if lane == 0u && !is_over && !region_holds(group_region(group), box_in(group)) {
        atomicOr(&status.invalid, INVALID_LIST);
    }
    let force = contact_force(group, lane, exists, particle, position.xyz, velocity.xyz);
    var moved = Moved(position.xyz, velocity.xyz);
    if exists {
        let sum = particle_force(particle, position, velocity) + force;
        moved = particle_advance(particle, position, velocity, sum, is_over);
    }
    group_check(group, lane, moved.position, moved.velocity, substep.contact_tick + 1u);
}
//!end
