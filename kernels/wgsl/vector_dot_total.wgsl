// NUMERICS section 5: the scalar product from those of all blocks.
//!include model solve

@compute @workgroup_size(SOLVE_THREADS)
fn main(@builtin(local_invocation_index) thread: u32) {
    let total = partials_total(thread, 0u);
    if thread == 0u {
        solve.scalar = total.x;
    }
}
