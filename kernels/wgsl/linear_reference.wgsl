// NUMERICS section 5, linear solvers: keeps |r|^2 of the start at z, where the iteration starts elsewhere.
//!include model solve

@compute @workgroup_size(SOLVE_THREADS)
fn main(@builtin(local_invocation_index) thread: u32) {
    let total = partials_total(thread, 0u);
    if thread == 0u {
        solve.next.reference = total.y;
        if solve.next.phase == SOLVE_RUNNING && total.y == 0.0 {
            solve.next.residual = 0.0;
            solve.next.phase = SOLVE_CONVERGED;
        }
    }
}
