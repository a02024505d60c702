// NUMERICS section 5: the same value in every particle.
//!include model status call vectors

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count {
        return;
    }
    vector_set(call.vector_to, particle, vec3f(call.value_x, call.value_y, call.value_z));
}
