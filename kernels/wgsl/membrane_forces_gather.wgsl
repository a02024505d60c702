// NUMERICS section 11: adds the forces of stretched triangles of fabric.
//!include model status force fabric_gather

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    force[particle] = vec4f(force[particle].xyz + membrane_force(particle), 0.0);
}
