// NUMERICS section 5, linear solvers: when an iteration ends.

// Whether the iteration ends with this state, as a phase.
fn phase_after(state: SolveState) -> u32 {
    let limit = call.tolerance * sqrt(state.reference);
    let is_finite = is_number(state.residual) && is_number(state.reference);
    if !(is_finite && (is_number(state.gamma) || call_has(CALL_SCHWARZ))) {
        return SOLVE_BROKEN;
    }
    var is_good = sqrt(state.residual) <= limit;
    if call_has(CALL_ENERGY) {
        is_good = state.residual == 0.0 || (state.energy >= 0.0 && state.energy <= call.tolerance);
    }
    if is_good {
        return SOLVE_CONVERGED;
    }
    if call_has(CALL_SCHWARZ) && state.iteration < call.iterations_max && !(is_number(state.gamma) && state.gamma > 0.0) {
        return SOLVE_INDEFINITE;
    }
    if state.gamma == 0.0 || state.iteration >= call.iterations_max {
        return SOLVE_ENDED;
    }
    return SOLVE_RUNNING;
}
