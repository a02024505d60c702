// NUMERICS section 4: symplectic Euler.
//!include model substep status motion motion_out force integrate

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
    var step = Step(position.xyz, velocity.xyz);
    if !is_stopped() {
        step = integrate(position.xyz, position.w, velocity.xyz, force[particle].xyz);
    }
    position_out[particle] = vec4f(step.position, position.w);
    velocity_out[particle] = vec4f(step.velocity, velocity.w);
}
