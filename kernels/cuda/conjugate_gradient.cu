// NUMERICS section 5, `conjugate_gradient`: a whole solve in one cooperative launch, with two meetings of all blocks in each iteration, and
// with `schwarz` those of that preconditioner.

// From one iteration to the next, y is kept in the last numbers of p, q and r, which would be read and written for nothing. Puts it
// where it belongs.
__device__ __forceinline__ void solution_unpack(const Solver& s, const Linear& l) {
    SolverPasses::for_own(s.count, [&](uint i) {
        vec3 y = {l.vectors[DIRECTION][i].w, l.vectors[DIRECTION_IMAGE][i].w, l.vectors[RESIDUAL][i].w};
        l.vectors[SOLUTION][i] = with_w(y, 0);
    });
}

extern "C" __global__ void __launch_bounds__(SOLVER_THREADS, SOLVER_BLOCKS) conjugate_gradient(const __grid_constant__ Solver s, const __grid_constant__ Linear l, double tolerance, uint iterations_max, uint from_solution, uint by_energy) {
    __shared__ SolverSums memory;
    __shared__ EnergyEstimate energy;
    Solve solve = SolverPasses::begin(s, l, memory, from_solution, by_energy);
    if (!solve.iterates) return;
    uint units = SolverPasses::units_of(s.count);
    if (threadIdx.x == 0) energy.begin(solve.closer);
    __syncthreads();
    Recurrence recurrence = {0, 0};
    double gamma = solve.gamma, residual = solve.residual;
    for (uint iteration = 0;; iteration++) {
        bool is_last = iteration == iterations_max;
        bool is_good = by_energy ? residual == 0 || energy.relative <= tolerance : residual <= tolerance * solve.reference;
        End end(is_good, residual, gamma, is_last);
#ifdef CLOTH_SCHWARZ
        bool indefinite = !(is_good || is_last || gamma > 0);
#else
        bool indefinite = false;
#endif
        if (end.is_reached || indefinite) {
            if (iteration > 0) solution_unpack(s, l);
            finish(l, iteration, residual / solve.reference, end.converged, end.breakdown, indefinite, energy.relative);
            return;
        }
        SolverPasses::for_rows(s, l, memory, l.vectors[PRECONDITIONED], 1, l.partials, l.partials, [&](uint i, const real4& origin, const vec3& row) {
            vec3 c = xyz(l.vectors[PRECONDITIONED][i]);
            vec3 image = filtered(l, i, origin.w > 0, row);
            l.vectors[IMAGE][i] = with_w(image, 0);
            return Products{dot(c, image), 0};
        });
        grid_barrier(&s.status->barrier[1]);
        double delta, unused, beta;
        memory.add_blocks(1, l.partials, l.partials, units, delta, unused);
        if (!recurrence.advance(gamma, delta, beta)) {
            if (iteration > 0) solution_unpack(s, l);
            finish(l, iteration, residual / solve.reference, end.converged, iteration == 0, true, energy.relative);
            return;
        }
        if (threadIdx.x == 0) energy.add(recurrence.alpha * gamma);
        real a = (real)recurrence.alpha, b = (real)beta;
        double* sums[2] = {l.partials + units, l.partials + 2 * units};
        SolverPasses::for_particles(s, memory, 2, sums[0], sums[1], [&](uint i) {
            vec3 p = xyz(l.vectors[PRECONDITIONED][i]), q = xyz(l.vectors[IMAGE][i]), y;
            real4 last_r = l.vectors[RESIDUAL][i];
            if (iteration == 0) {
                y = xyz(l.vectors[SOLUTION][i]);
            } else {
                real4 last_p = l.vectors[DIRECTION][i], last_q = l.vectors[DIRECTION_IMAGE][i];
                y = {last_p.w, last_q.w, last_r.w};
                if (b != 0) {
                    p = p + b * xyz(last_p);
                    q = q + b * xyz(last_q);
                }
            }
            y = a * p + y;
            vec3 r = (-a) * q + xyz(last_r);
            l.vectors[DIRECTION][i] = with_w(p, y.x);
            l.vectors[DIRECTION_IMAGE][i] = with_w(q, y.y);
            return SolverPasses::residual_store(s, l, i, r, y.z);
        });
        SolverPasses::residual_sums(s, l, memory, sums, residual, gamma);
    }
}

#ifdef CLOTH_SCHWARZ
extern "C" __global__ void __launch_bounds__(SOLVER_THREADS, SOLVER_BLOCKS) preconditioner_apply_schwarz(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint from, uint to) {
    __shared__ SolverSums memory;
    SolverPasses::precondition(s, l, memory, from, to, l.partials);
}
#endif
