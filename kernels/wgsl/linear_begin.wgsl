// NUMERICS section 5, linear solvers: a solve begins. A later one of a substep does nothing if no contact
// changed, or if an earlier one broke down.
//!include model substep status call solve

@compute @workgroup_size(1)
fn main() {
    let before = solve.next.phase;
    let again = call.pass_number > 0u;
    let is_changed = atomicLoad(&solve.changed) > 0u || call_has(CALL_REFINE);
    let is_needed = !again || (before != SOLVE_SKIPPED && before != SOLVE_BROKEN && is_changed);
    let runs = is_needed && !is_stopped();
    atomicStore(&solve.changed, 0u);
    solve.next.phase = select(SOLVE_SKIPPED, SOLVE_RUNNING, runs);
    solve.next.iteration = 0u;
    solve.next.gamma = 0.0;
    solve.next.residual = 0.0;
    solve.next.reference = -1.0;
    solve.next.alpha_before = 0.0;
    solve.next.gamma_before = 0.0;
    solve.next.omega = 1.0;
    solve.next.halvings = 0u;
    solve.outcome_phase = solve.next.phase;
}
