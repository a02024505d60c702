// NUMERICS section 7: contact with all colliders, in place.
//!include model substep status motion_out collider
//!if grids
//!include distance_grid
//!end
//!if not grids
//!include distance_grid_none
//!end
//!if start
//!include position_start
//!end
//!if not start
//!include position_start_none
//!end
//!if feedback
//!include feedback
//!end
//!if not feedback
//!include feedback_none
//!end

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let position = position_out[particle];
    if position.w > 0.0 {
        let velocity = velocity_out[particle];
        let before = Moved(position.xyz, velocity.xyz);
        let moved = collide_all(particle, velocity.w, start_of(particle, before.position), before);
        position_out[particle] = vec4f(moved.position, position.w);
        velocity_out[particle] = vec4f(moved.velocity, velocity.w);
    }
}
