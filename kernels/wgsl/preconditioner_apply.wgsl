// NUMERICS section 5: to = S P^-1 from.
//!include model status call motion vectors symmetric matrix preconditioner
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
    let result = preconditioned(particle, kind, vector_get(call.vector_from, particle));
    vector_set(call.vector_to, particle, result);
}
