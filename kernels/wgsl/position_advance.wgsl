// NUMERICS section 5: x += amount v.
//!include model status call motion motion_out

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count {
        return;
    }
    var position = position_in[particle];
    var velocity = velocity_in[particle];
    if !is_stopped() {
        position = vec4f(add_scaled(position.xyz, call.amount, velocity.xyz), position.w);
    }
    position_out[particle] = position;
    velocity_out[particle] = velocity;
}
