// NUMERICS section 5, linear solvers: z as the direction, and the solution where the iteration starts.
//!include model status call motion vectors symmetric matrix solve
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
    if particle >= model.particle_count || solve.next.phase != SOLVE_RUNNING {
        return;
    }
    let kind = filter_kind_now(particle, position_in[particle].w);
    var change = vec3f(0.0);
    if kind == FILTER_CONSTRAINED {
        change = constraint_change(particle, velocity_in[particle].xyz);
    }
    vector_set(VECTOR_DIRECTION, particle, change);
    var start = change;
    if call_has(CALL_FROM_SOLUTION) {
        start += filtered(particle, kind, vector_get(VECTOR_SOLUTION, particle));
    }
    vector_set(VECTOR_SOLUTION, particle, start);
}
