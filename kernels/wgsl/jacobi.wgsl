// NUMERICS section 5, Jacobi, second half of an iteration: y += omega c. `linear_residual` is the first.
//!include model call vectors solve solve_check

// Times that the damping may be halved; after that the iteration stops where it is.
const HALVINGS_MAX: u32 = 20u;

@compute @workgroup_size(SOLVE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    var state = solve.current;
    if phase_uniform(thread, state.phase) != SOLVE_RUNNING {
        return;
    }
    let total = partials_total(thread, 0u);
    state.gamma = total.x;
    state.residual = total.y;
    if state.reference < 0.0 {
        state.reference = total.y;
    }
    var phase = SOLVE_RUNNING;
    if state.iteration > 0u && state.gamma >= state.gamma_before {
        if state.halvings == HALVINGS_MAX {
            phase = SOLVE_ENDED;
        }
        state.halvings += 1u;
        state.omega *= 0.5;
    }
    if phase == SOLVE_RUNNING {
        phase = phase_after(state);
    }
    phase = phase_uniform(thread, phase);
    if block == 0u && thread == 0u {
        var after = state;
        after.phase = phase;
        if phase == SOLVE_RUNNING {
            after.iteration += 1u;
            after.gamma_before = state.gamma;
        }
        solve.next = after;
    }
    if phase != SOLVE_RUNNING {
        return;
    }
    for (var k = 0u; k < model.solve_repeats; k += 1u) {
        let particle = (block * model.solve_repeats + k) * SOLVE_THREADS + thread;
        if particle < model.particle_count {
            let change = vector_get(VECTOR_PRECONDITIONED, particle);
            let solution = vector_get(VECTOR_SOLUTION, particle);
            vector_set(VECTOR_SOLUTION, particle, add_scaled(solution, state.omega, change));
        }
    }
}
