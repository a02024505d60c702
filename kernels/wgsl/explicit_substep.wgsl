// The composite stage: all forces, integration and, where nothing comes between, colliders, in one
// pass over the particles. It is made of the same functions as the single stages.
//!include model substep status motion motion_out finite field spring integrate collider procedural
//!if grids
//!include distance_grid
//!end
//!if not grids
//!include distance_grid_none
//!end
//!if impulses
//!include impulses
//!end
//!if not impulses
//!include impulses_none
//!end
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end
//!if air
//!include triangles air
//!end
//!if wide
//!include contact_turn_wide
//!end
//!if not wide
//!include contact_turn
//!end
//!if penalty
//!include contact_pair contact_counts contact_penalty group group_box group_rows group_region
//!include contact_exclusions_none contact_kept contact_search contact_spill contact_force group_check
//!end

// A particle after the substep; `contact_force` is what contact with other particles adds.
fn particle_advance(particle: u32, position: vec4f, velocity: vec4f, contact_force: vec3f, is_over: bool) -> Moved {
    var sum = field_force(velocity.w, velocity.xyz);
    sum = procedural_force(sum, particle, position.xyz, velocity.xyz, velocity.w);
    sum = spring_force(sum, particle, position.xyz, velocity.xyz);
//!if air
    sum += air_force(particle);
//!end
//!if penalty
    sum += contact_force;
//!end
    let step = integrate(position.xyz, position.w, velocity.xyz, sum);
    var moved = Moved(step.position, step.velocity);
    if model.colliders_in_pass != 0u && substep.collider_count != 0u && position.w > 0.0 {
        moved = collide_all(particle, velocity.w, moved);
    }
    if is_over {
        moved = Moved(position.xyz, velocity.xyz);
    } else if !(is_finite(moved.position) && is_finite(moved.velocity)) {
        atomicMin(&status.stopped, substep.serial);
    }
    position_out[particle] = vec4f(moved.position, position.w);
    velocity_out[particle] = vec4f(moved.velocity, velocity.w);
    return moved;
}

// A number that is not finite may be found in this very substep, by another particle: only an earlier one stops
// it.
fn is_over() -> bool {
    return atomicLoad(&status.stopped) < substep.serial;
}

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
    particle_advance(particle, position, velocity, vec3f(0.0), is_over());
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
    if lane == 0u && !is_over && !group_holds(group, box_in(group)) {
        atomicOr(&status.invalid, INVALID_LIST);
    }
    let force = contact_force(group, lane, exists, particle, position.xyz, velocity.xyz);
    var moved = Moved(position.xyz, velocity.xyz);
    if exists {
        moved = particle_advance(particle, position, velocity, force, is_over);
    }
    group_check(group, lane, moved.position, moved.velocity, substep.contact_tick + 1u);
}
//!end
