// NUMERICS section 5: y = S y.
//!include model status call motion vectors symmetric matrix
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!include filter

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let kind = filter_kind_now(particle, position_in[particle].w);
    vector_set(call.vector_to, particle, filtered(particle, kind, vector_get(call.vector_to, particle)));
}
