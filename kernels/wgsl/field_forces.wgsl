// NUMERICS section 3: sets the force to gravity, uniform fields and drag.
//!include model status motion force field

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let velocity = velocity_in[particle];
    force[particle] = vec4f(field_force(velocity.w, velocity.xyz), 0.0);
}
