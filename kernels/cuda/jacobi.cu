// NUMERICS section 5, `jacobi`: a whole solve in one cooperative launch, with two meetings of all blocks in each iteration.

extern "C" __global__ void __launch_bounds__(SOLVER_THREADS, SOLVER_BLOCKS) jacobi(const __grid_constant__ Solver s, const __grid_constant__ Linear l, double tolerance, uint iterations_max, uint from_solution) {
    __shared__ SolverSums memory;
    Solve solve = SolverPasses::begin(s, l, memory, from_solution);
    if (!solve.iterates) return;
    Damping damping = {1, 0};
    double norm = solve.gamma, residual = solve.residual;
    for (uint iteration = 0;; iteration++) {
        End end(solve, tolerance, residual, norm, iteration == iterations_max);
        if (end.is_reached) {
            finish(l, iteration, residual / solve.reference, end.converged, end.breakdown);
            return;
        }
        real w = (real)damping.omega;
        SolverPasses::for_own(s.count, [&](uint i) {
            vec3 y = w * xyz(l.vectors[PRECONDITIONED][i]) + xyz(l.vectors[SOLUTION][i]);
            l.vectors[SOLUTION][i] = with_w(y, 0);
        });
        grid_barrier(&s.status->barrier[1]);
        double before = norm;
        SolverPasses::residual_of(s, l, memory, l.vectors[SOLUTION], residual, norm);
        if (!damping.advance(before, norm)) {
            finish(l, iteration, residual / solve.reference, end.converged, end.breakdown);
            return;
        }
    }
}
