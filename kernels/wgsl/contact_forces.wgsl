// NUMERICS section 8: adds the penalty force of all pairs in contact.
//!include model substep status motion force contact_list contact_partners contact_penalty

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let position = position_in[particle].xyz;
    contact_list_verify(particle, position);
    let sum = contact_force(particle, position, velocity_in[particle].xyz);
    force[particle] = vec4f(force[particle].xyz + sum, 0.0);
}
