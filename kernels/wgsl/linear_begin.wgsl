// NUMERICS section 5, linear solvers: a solve begins. A later one of a substep does nothing if no contact
// changed, or if an earlier one broke down.
//!include model substep status call solve solve_begin

@compute @workgroup_size(1)
fn main() {
    let before = solve.next.phase;
    let again = call.pass_number > 0u;
    let is_changed = atomicLoad(&solve.changed) > 0u || call_has(CALL_REFINE);
    let is_needed = !again || (before != SOLVE_SKIPPED && before != SOLVE_BROKEN && is_changed);
    let runs = is_needed && !is_stopped();
    solve_begin(runs);
}
