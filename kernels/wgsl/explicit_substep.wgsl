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
//!if penalty
//!include contact_list contact_partners contact_penalty
//!end

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
    // A number that is not finite may be found in this very substep, by another particle: only an
    // earlier one stops it. Looked at late, so that nothing waits for it.
    let is_over = atomicLoad(&status.stopped) < substep.serial;
    var sum = field_force(velocity.w, velocity.xyz);
    sum = procedural_force(sum, particle, position.xyz, velocity.xyz, velocity.w);
    sum = spring_force(sum, particle, position.xyz, velocity.xyz);
//!if air
    sum += air_force(particle);
//!end
//!if penalty
    if !is_over {
        contact_list_verify(particle, position.xyz);
    }
    sum += contact_force(particle, position.xyz, velocity.xyz);
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
}
