// NUMERICS section 3: adds the forces of procedural fields.
//!include model substep status motion force procedural

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
    let before = force[particle].xyz;
    let after = procedural_force(before, particle, position_in[particle].xyz, velocity.xyz, velocity.w);
    force[particle] = vec4f(after, 0.0);
}
