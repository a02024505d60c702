// NUMERICS section 5, conjugate gradient: the kernel of the first half of an iteration, whatever the rows are made of.

@compute @workgroup_size(SOLVE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    let phase = phase_uniform(thread, solve.next.phase);
    if block == 0u {
        let total = partials_total(thread, 0u);
        if thread == 0u {
            var state = solve.next;
            if phase == SOLVE_RUNNING {
                state.gamma = total.x;
                state.residual = total.y;
                if state.reference < 0.0 {
                    state.reference = total.y;
                }
            }
            solve.current = state;
        }
    }
    if phase != SOLVE_RUNNING {
        return;
    }
    var sum = vec2f(0.0);
    for (var k = 0u; k < model.solve_repeats; k += 1u) {
        let particle = (block * model.solve_repeats + k) * SOLVE_THREADS + thread;
        if particle < model.particle_count {
            let image = filtered(particle, filter_kind(particle), matrix_row(particle, VECTOR_PRECONDITIONED));
            vector_set(VECTOR_IMAGE, particle, image);
            sum.x += dot_product(vector_get(VECTOR_PRECONDITIONED, particle), image);
        }
    }
    let total = workgroup_sum(thread, sum);
    if thread == 0u && block < model.solve_blocks {
        partials[PARTIALS_MAX + block] = total;
    }
}
