// NUMERICS section 5, `conjugate_gradient` and `jacobi`: a whole solve in one cooperative launch. Blocks of 512
// particles, two meetings of all blocks in each iteration.

#if defined(CLOTH_F64) || defined(CLOTH_WIDE)
#define SOLVER_BLOCKS 1
#else
#define SOLVER_BLOCKS 2
#endif

struct Solve {
    double reference;
    double residual;
    // r . c
    double gamma;
    // Whether there is something to do.
    bool iterates;
};

__device__ __forceinline__ void finish(const Linear& l, uint iterations, double residual, bool converged, bool breakdown) {
    if (blockIdx.x + threadIdx.x > 0) return;
    l.outcome->iterations = iterations;
    l.outcome->residual = residual;
    l.outcome->converged = converged;
    l.outcome->breakdown = breakdown;
}

__device__ __forceinline__ bool is_finite(double a) { return fabs(a) <= 1.7976931348623157e308; }

// r = S (b - A y) and c = S P^-1 r for a vector y whose entries all blocks have written, or r = S b without
// one; then |r| and r . c.
__device__ void residual_of(const Solver& s, const Linear& l, SumMemory& memory, const real4* y, double& residual, double& gamma) {
    uint blocks = (s.count + SUM_BLOCK - 1) / SUM_BLOCK;
    for (uint block = blockIdx.x; block < blocks; block += gridDim.x) {
        uint i = block * SUM_BLOCK + threadIdx.x;
        vec3 r = {0, 0, 0}, c = {0, 0, 0};
        if (i < s.count) {
            r = xyz(l.vectors[RIGHT_SIDE][i]);
            if (y != nullptr) r = r - matrix_row(s, l, y, i);
            r = filtered(s, l, i, r);
            c = filtered(s, l, i, preconditioned(l, i, r));
            l.vectors[RESIDUAL][i] = with_w(r, 0);
            l.vectors[PRECONDITIONED][i] = with_w(c, 0);
        }
        sum_put(memory, 0, r, c);
        sum_put(memory, 1, r, r);
        sum_block(memory, 2, &l.partials[blocks + block], &l.partials[2 * blocks + block]);
    }
    grid_barrier(&s.status->barrier[2]);
    double square;
    sum_total(memory, l.partials + blocks, l.partials + 2 * blocks, blocks, gamma, square);
    residual = sqrt(square);
}

// Puts the solution where the iteration starts, and its residual with it.
__device__ Solve begin(const Solver& s, const Linear& l, SumMemory& memory, uint from_solution) {
    uint blocks = (s.count + SUM_BLOCK - 1) / SUM_BLOCK;
    for (uint block = blockIdx.x; block < blocks; block += gridDim.x) {
        uint i = block * SUM_BLOCK + threadIdx.x;
        vec3 z = {0, 0, 0};
        if (i < s.count) {
            z = projected(s, l, i, z);
            l.vectors[DIRECTION][i] = with_w(z, 0);
        }
        sum_put(memory, 0, z, z);
        sum_block(memory, 1, &l.partials[block], &l.partials[block]);
    }
    grid_barrier(&s.status->barrier[2]);
    double square, unused;
    sum_total(memory, l.partials, l.partials, blocks, square, unused);
    Solve solve;
    residual_of(s, l, memory, square == 0 ? nullptr : l.vectors[DIRECTION], solve.reference, solve.gamma);
    solve.residual = solve.reference;
    solve.iterates = true;
    if (solve.reference == 0 || !from_solution) {
        for (uint block = blockIdx.x; block < blocks; block += gridDim.x) {
            uint i = block * SUM_BLOCK + threadIdx.x;
            if (i < s.count) l.vectors[SOLUTION][i] = l.vectors[DIRECTION][i];
        }
    }
    if (solve.reference == 0) {
        finish(l, 0, 0, true, false);
        solve.iterates = false;
        return solve;
    }
    if (from_solution) {
        for (uint block = blockIdx.x; block < blocks; block += gridDim.x) {
            uint i = block * SUM_BLOCK + threadIdx.x;
            if (i < s.count) l.vectors[SOLUTION][i] = with_w(projected(s, l, i, xyz(l.vectors[SOLUTION][i])), 0);
        }
        grid_barrier(&s.status->barrier[2]);
        residual_of(s, l, memory, l.vectors[SOLUTION], solve.residual, solve.gamma);
    }
    if (!(is_finite(solve.reference) && is_finite(solve.residual))) {
        finish(l, 0, 1.0 / 0.0, false, true);
        solve.iterates = false;
    }
    return solve;
}

extern "C" __global__ void __launch_bounds__(512, SOLVER_BLOCKS) conjugate_gradient(const __grid_constant__ Solver s, const __grid_constant__ Linear l, double tolerance, uint iterations_max, uint from_solution) {
    __shared__ SumMemory memory;
    Solve solve = begin(s, l, memory, from_solution);
    if (!solve.iterates) return;
    uint blocks = (s.count + SUM_BLOCK - 1) / SUM_BLOCK;
    double gamma = solve.gamma, residual = solve.residual, alpha = 0, gamma_before = 0;
    for (uint iteration = 0;; iteration++) {
        bool converged = residual <= tolerance * solve.reference;
        bool breakdown = !(is_finite(residual) && is_finite(gamma));
        if (converged || breakdown || gamma == 0 || iteration == iterations_max) {
            finish(l, iteration, residual / solve.reference, converged, breakdown);
            return;
        }
        for (uint block = blockIdx.x; block < blocks; block += gridDim.x) {
            uint i = block * SUM_BLOCK + threadIdx.x;
            vec3 c = {0, 0, 0}, image = {0, 0, 0};
            if (i < s.count) {
                c = xyz(l.vectors[PRECONDITIONED][i]);
                image = filtered(s, l, i, matrix_row(s, l, l.vectors[PRECONDITIONED], i));
                l.vectors[IMAGE][i] = with_w(image, 0);
            }
            sum_put(memory, 0, c, image);
            sum_block(memory, 1, &l.partials[block], &l.partials[block]);
        }
        grid_barrier(&s.status->barrier[2]);
        double delta, unused;
        sum_total(memory, l.partials, l.partials, blocks, delta, unused);
        double beta = 0, curvature = delta;
        if (alpha != 0) {
            beta = gamma / gamma_before;
            curvature = delta - beta * gamma / alpha;
        }
        double next = gamma / curvature;
        if (!(curvature > 0 && is_finite(next))) {
            finish(l, iteration, residual / solve.reference, converged, iteration == 0);
            return;
        }
        alpha = next;
        gamma_before = gamma;
        real a = (real)alpha, b = (real)beta;
        for (uint block = blockIdx.x; block < blocks; block += gridDim.x) {
            uint i = block * SUM_BLOCK + threadIdx.x;
            vec3 r = {0, 0, 0}, c = {0, 0, 0};
            if (i < s.count) {
                vec3 p = xyz(l.vectors[PRECONDITIONED][i]), q = xyz(l.vectors[IMAGE][i]);
                if (b != 0) {
                    p = p + b * xyz(l.vectors[DIRECTION][i]);
                    q = q + b * xyz(l.vectors[DIRECTION_IMAGE][i]);
                }
                l.vectors[DIRECTION][i] = with_w(p, 0);
                l.vectors[DIRECTION_IMAGE][i] = with_w(q, 0);
                l.vectors[SOLUTION][i] = with_w(a * p + xyz(l.vectors[SOLUTION][i]), 0);
                r = (-a) * q + xyz(l.vectors[RESIDUAL][i]);
                c = filtered(s, l, i, preconditioned(l, i, r));
                l.vectors[RESIDUAL][i] = with_w(r, 0);
                l.vectors[PRECONDITIONED][i] = with_w(c, 0);
            }
            sum_put(memory, 0, r, c);
            sum_put(memory, 1, r, r);
            sum_block(memory, 2, &l.partials[blocks + block], &l.partials[2 * blocks + block]);
        }
        grid_barrier(&s.status->barrier[2]);
        double square;
        sum_total(memory, l.partials + blocks, l.partials + 2 * blocks, blocks, gamma, square);
        residual = sqrt(square);
    }
}

#define HALVINGS_MAX 20

extern "C" __global__ void __launch_bounds__(512, SOLVER_BLOCKS) jacobi(const __grid_constant__ Solver s, const __grid_constant__ Linear l, double tolerance, uint iterations_max, uint from_solution) {
    __shared__ SumMemory memory;
    Solve solve = begin(s, l, memory, from_solution);
    if (!solve.iterates) return;
    uint blocks = (s.count + SUM_BLOCK - 1) / SUM_BLOCK;
    double norm = solve.gamma, residual = solve.residual, omega = 1;
    uint halvings = 0;
    for (uint iteration = 0;; iteration++) {
        bool converged = residual <= tolerance * solve.reference;
        bool breakdown = !(is_finite(residual) && is_finite(norm));
        if (converged || breakdown || norm == 0 || iteration == iterations_max) {
            finish(l, iteration, residual / solve.reference, converged, breakdown);
            return;
        }
        real w = (real)omega;
        for (uint block = blockIdx.x; block < blocks; block += gridDim.x) {
            uint i = block * SUM_BLOCK + threadIdx.x;
            if (i < s.count) {
                vec3 y = w * xyz(l.vectors[PRECONDITIONED][i]) + xyz(l.vectors[SOLUTION][i]);
                l.vectors[SOLUTION][i] = with_w(y, 0);
            }
        }
        grid_barrier(&s.status->barrier[2]);
        double before = norm;
        residual_of(s, l, memory, l.vectors[SOLUTION], residual, norm);
        if (norm >= before) {
            if (halvings == HALVINGS_MAX) {
                finish(l, iteration, residual / solve.reference, converged, breakdown);
                return;
            }
            halvings++;
            omega *= 0.5;
        }
    }
}
