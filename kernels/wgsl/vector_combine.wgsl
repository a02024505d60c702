// NUMERICS section 5: to = from_scale from + to_scale to. A scale of zero drops its vector.
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
    var sum = vec3f(0.0);
    if call.to_scale != 0.0 {
        sum = call.to_scale * vector_get(call.vector_to, particle);
    }
    if call.from_scale != 0.0 {
        sum = add_scaled(sum, call.from_scale, vector_get(call.vector_from, particle));
    }
    vector_set(call.vector_to, particle, sum);
}
