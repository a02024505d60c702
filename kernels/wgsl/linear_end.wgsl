// NUMERICS section 5, linear solvers: what became of a solve, after the iterations that were recorded. If it
// needs more of them, that is noted: the host then records more.
//!include model substep status call solve solve_check

@compute @workgroup_size(SOLVE_THREADS)
fn main(@builtin(local_invocation_index) thread: u32) {
    let total = partials_total(thread, 0u);
    if thread != 0u || solve.next.phase == SOLVE_SKIPPED {
        return;
    }
    var state = solve.next;
    if state.phase == SOLVE_RUNNING {
        state.gamma = total.x;
        state.residual = total.y;
        if state.reference < 0.0 {
            state.reference = total.y;
        }
        state.phase = phase_after(state);
    }
    var relative = 0.0;
    if state.reference > 0.0 {
        relative = sqrt(state.residual) / sqrt(state.reference);
    }
    solve.outcome_phase = state.phase;
    solve.outcome_iterations = state.iteration;
    solve.outcome_residual = relative;
    let deferred = call_has(CALL_DEFERRED);
    if state.phase == SOLVE_RUNNING {
        if deferred {
            atomicOr(&status.invalid, INVALID_ITERATIONS);
        }
        return;
    }
    solve.next.phase = state.phase;
    if !deferred {
        return;
    }
    solve.solves += 1u;
    if state.phase != SOLVE_CONVERGED {
        solve.solves_unconverged += 1u;
    }
    solve.iterations += state.iteration;
    solve.residual_max = max(solve.residual_max, relative);
    let place = min(call.pass_number, 3u);
    solve.iterations_most[place] = max(solve.iterations_most[place], state.iteration);
    if state.phase == SOLVE_BROKEN {
        atomicMin(&status.broken, substep.serial);
    }
}
