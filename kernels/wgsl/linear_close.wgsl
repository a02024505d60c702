// NUMERICS section 5: after the last solve of a substep that was recorded. If contacts changed and there
// may be another solve, that is noted: the host then records it.
//!include model substep status call solve

@compute @workgroup_size(1)
fn main() {
    let ran = solve.next.phase != SOLVE_SKIPPED && solve.next.phase != SOLVE_BROKEN;
    if ran && atomicLoad(&solve.changed) > 0u && call.pass_number + 1u < call.pass_count {
        atomicOr(&status.invalid, INVALID_PASSES);
    }
}
