// NUMERICS section 5, `schwarz`: to = S P^-1 from, from the blocks of particles and what the first level of groups has found, and the sums of
// to . from and from . from.
//!include model call motion vectors symmetric matrix solve schwarz
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!include filter preconditioner

@compute @workgroup_size(SOLVE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if schwarz_rests(thread) {
        return;
    }
    let block = workgroup.x + workgroup.y * groups.x;
    let head = schwarz_head();
    let second = schwarz_level(0u).second;
    var sum = vec2f(0.0);
    for (var k = 0u; k < model.solve_repeats; k += 1u) {
        let particle = (block * model.solve_repeats + k) * SOLVE_THREADS + thread;
        if particle < model.particle_count {
            let coarse = second + NODE * schwarz_tables[head.group_of + particle];
            let rows = head.prolongation + 3u * NODE * schwarz_tables[head.places + particle];
            var result = vec3f(0.0);
            for (var mode = 0u; mode < NODE; mode += 1u) {
                let row = vec3f(schwarz_number(rows + mode), schwarz_number(rows + NODE + mode), schwarz_number(rows + 2u * NODE + mode));
                result = add_scaled(result, schwarz_vectors[coarse + mode], row);
            }
            let given = vector_get(call.vector_from, particle);
            let kind = filter_kind_now(particle, position_in[particle].w);
            result = preconditioned(particle, kind, given) + filtered(particle, kind, result);
            vector_set(call.vector_to, particle, result);
            sum += vec2f(dot_product(given, result), dot_product(given, given));
        }
    }
    let total = workgroup_sum(thread, sum);
    if thread == 0u && block < model.solve_blocks {
        partials[block] = total;
    }
}
