// NUMERICS section 5, linear solvers: when an iteration ends.

// Whether the iteration ends with this state, as a phase.
fn phase_after(state: SolveState) -> u32 {
    let limit = call.tolerance * sqrt(state.reference);
    if !(is_number(state.residual) && is_number(state.gamma) && is_number(state.reference)) {
        return SOLVE_BROKEN;
    }
    if sqrt(state.residual) <= limit {
        return SOLVE_CONVERGED;
    }
    if state.gamma == 0.0 || state.iteration >= call.iterations_max {
        return SOLVE_ENDED;
    }
    return SOLVE_RUNNING;
}
