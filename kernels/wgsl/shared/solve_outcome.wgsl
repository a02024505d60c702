// NUMERICS section 5, linear solvers: what becomes of a solve after the iterations that were recorded.

// The state after the last iteration, for all threads, and whether the solve ends with it.
fn solve_last(thread: u32) -> SolveState {
    let is_odd = call_has(CALL_ODD);
    let total = partials_total(thread, select(0u, PARTIALS_ODD, is_odd));
    var state = solve.next;
    if is_odd {
        state = solve.current;
    }
    if state.phase == SOLVE_RUNNING {
        state.gamma = total.x;
        state.residual = total.y;
        if state.reference < 0.0 {
            state.reference = total.y;
        }
        state.phase = phase_after(state);
    }
    return state;
}

// Notes it, by one thread. If more iterations are needed that is noted too: the host then records more.
fn solve_note(state: SolveState) {
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
