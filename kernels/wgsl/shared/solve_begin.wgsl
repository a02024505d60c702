// NUMERICS section 5, linear solvers: the scalars of a solve that begins, or is left out.

fn solve_begin(runs: bool) {
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
    solve.next.energy = -1.0;
    solve.energy_before = 0.0;
    solve.energy_stride = 1u;
    solve.energy_filled = 0u;
    solve.energy_last = 0u;
    solve.outcome_phase = solve.next.phase;
}
