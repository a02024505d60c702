// NUMERICS section 7: contact with all colliders, in place.
//!include model substep status motion_out collider

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
        let moved = collide_all(cloth_offset(particle), before);
        position_out[particle] = vec4f(moved.position, position.w);
        velocity_out[particle] = vec4f(moved.velocity, velocity.w);
    }
}
