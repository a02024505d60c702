// NUMERICS section 5, linear solvers: r = S (b - A y) of a vector y, c = S P^-1 r, and the sums of r . c and
// r . r.
//!include model call vectors symmetric links matrix preconditioner matrix_entry matrix_springs matrix_row solve
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!if penalty
//!include contact_row
//!end
//!if not penalty
//!include contact_row_none
//!end
//!if triangles
//!include contact_table contact_times triangle_row
//!end
//!if not triangles
//!include triangle_row_none
//!end
//!if fabric
//!include element_row
//!end
//!if not fabric
//!include element_row_none
//!end
//!include filter

@compute @workgroup_size(SOLVE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    let phase = phase_uniform(thread, solve.next.phase);
    if block == 0u && thread == 0u {
        solve.current = solve.next;
    }
    let is_zero = phase == SOLVE_CONVERGED && solve.next.reference == 0.0 && !call_has(CALL_REFERENCE);
    var sum = vec2f(0.0);
    for (var k = 0u; k < model.solve_repeats; k += 1u) {
        let particle = (block * model.solve_repeats + k) * SOLVE_THREADS + thread;
        if particle < model.particle_count {
            if is_zero {
                // Nothing is to be solved: the solution is z.
                vector_set(VECTOR_SOLUTION, particle, vector_get(VECTOR_DIRECTION, particle));
            }
            if phase != SOLVE_RUNNING {
                continue;
            }
            let kind = filter_kind(particle);
            var rest = vector_get(VECTOR_RIGHT_SIDE, particle);
//!if colliders
            rest -= matrix_row(particle, call.vector_from);
//!end
//!if not colliders
            if !call_has(CALL_REFERENCE) {
                rest -= matrix_row(particle, call.vector_from);
            }
//!end
            let residual = filtered(particle, kind, rest);
            vector_set(VECTOR_RESIDUAL, particle, residual);
            if call_has(CALL_SCHWARZ) {
                continue;
            }
            let result = preconditioned(particle, kind, residual);
            vector_set(VECTOR_PRECONDITIONED, particle, result);
            sum += vec2f(dot_product(residual, result), dot_product(residual, residual));
        }
    }
    if phase != SOLVE_RUNNING {
        return;
    }
    let total = workgroup_sum(thread, sum);
    if thread == 0u && block < model.solve_blocks {
        partials[block] = total;
    }
}
