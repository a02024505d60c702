// NUMERICS section 5, linear solvers: what became of a solve.
//!include model substep status call solve solve_check solve_outcome

@compute @workgroup_size(SOLVE_THREADS)
fn main(@builtin(local_invocation_index) thread: u32) {
    let state = solve_last(thread);
    if thread == 0u && state.phase != SOLVE_SKIPPED {
        solve_note(state);
        solve.next = state;
    }
}
