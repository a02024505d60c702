// NUMERICS section 5, `conjugate_gradient` and `jacobi` of a patch of 24 neighbours that is too large to stay on the chip: a
// whole solve in one cooperative launch. Rows of the matrix are worked out tile by tile (`patch/neighbours24.cuh`), all else in steps.

#define THREADS 256
#define SOLVER_BLOCKS 2
#define TILE_WIDTH 32
#define TILE_OWN 2

typedef SumMemory<THREADS, 8> Sums;
typedef Passes<Sums> Pass;
typedef PatchTile<THREADS, TILE_WIDTH, TILE_OWN> Tile;

// As `Pass::begin`, up to where all blocks have done it: particles in tiles are not those in steps.
__device__ __forceinline__ Solve begin(const Solver& s, const Linear& l, Sums& memory, uint from_solution) {
    Solve solve = Pass::begin(s, l, memory, from_solution);
    if (solve.iterates) grid_barrier(&s.status->barrier[1]);
    return solve;
}

// Calls `visit` for each particle with its row of A times the vector whose entries `value` gives; other blocks must not read what
// it writes.
template <typename Value, typename Visit>
__device__ __forceinline__ void for_rows(const Solver& s, const Linear& l, real4* window, Value value, Visit visit) {
    uint count = Tile::count(s);
    for (uint number = blockIdx.x; number < count; number += gridDim.x) {
        Tile tile(window, s, number);
        tile.fill(s, l, value);
        __syncthreads();
        tile.for_rows(s, l, value, visit);
        __syncthreads();
    }
}

// Sums up products that other blocks have written: tiles do not end where the blocks of sums do.
template <typename Get> __device__ __forceinline__ void products_add(const Solver& s, const Linear& l, Sums& memory, uint count, Get get, double& a, double& b) {
    uint units = Pass::units_of(s.count);
    double *first = l.partials, *second = l.partials + units;
    grid_barrier(&s.status->barrier[1]);
    Pass::for_particles(s, memory, count, first, second, get);
    grid_barrier(&s.status->barrier[1]);
    memory.add_blocks(count, first, second, units, a, b);
}

// What is kept of the last iteration: p and q, and in their last numbers and beside them y, which is a step along p behind.
struct Kept {
    real4 p;
    real4 q;
    real y;
};

// So p and y are read and written where p is made anew, and nowhere else.
struct Iterates {
    real4* p;
    real4* q;
    real* y;
    const real4* start;

    __device__ __forceinline__ Iterates(const Linear& l, real* memory) : p(l.vectors[DIRECTION]), q(l.vectors[DIRECTION_IMAGE]), y(memory), start(l.vectors[SOLUTION]) {}

    __device__ __forceinline__ Kept load(uint i, uint iteration) const {
        real4 zero = {0, 0, 0, 0};
        if (iteration == 0) return {zero, zero, 0};
        Kept kept = {p[i], q[i], 0};
        if (iteration == 1) {
            real4 first = start[i];
            kept.p.w = first.x;
            kept.q.w = first.y;
            kept.y = first.z;
        } else {
            kept.y = y[i];
        }
        return kept;
    }

    static __device__ __forceinline__ vec3 solution(const Kept& kept) { return {kept.p.w, kept.q.w, kept.y}; }
};

extern "C" __global__ void __launch_bounds__(THREADS, SOLVER_BLOCKS) conjugate_gradient(const __grid_constant__ Solver s, const __grid_constant__ Linear l, double tolerance, uint iterations_max, uint from_solution, uint) {
    extern __shared__ real4 window[];
    __shared__ Sums memory;
    Solve solve = begin(s, l, memory, from_solution);
    if (!solve.iterates) return;
    uint units = Pass::units_of(s.count);
    real* products = (real*)l.vectors[IMAGE];
    Iterates iterates(l, products + s.count);
    // Puts y where it belongs, after its step by `a` unless it has been taken.
    auto solution_write = [&](uint iteration, bool is_behind, real a) {
        if (iteration == 0) return;
        Pass::Work work = Pass::work_of(s.count);
        for (uint k = 0; k < work.count; k++) {
            uint i = work.particle(k);
            if (i >= s.count) continue;
            Kept kept = iterates.load(i, is_behind ? iteration : iteration + 1);
            vec3 y = Iterates::solution(kept);
            if (is_behind) y = a * xyz(kept.p) + y;
            l.vectors[SOLUTION][i] = with_w(y, 0);
        }
    };
    Recurrence recurrence = {0, 0};
    double gamma = solve.gamma, residual = solve.residual;
    for (uint iteration = 0;; iteration++) {
        real last_a = (real)recurrence.alpha, b = (real)recurrence.share(gamma);
        End end(solve, tolerance, residual, gamma, iteration == iterations_max);
        if (end.is_reached) {
            solution_write(iteration, true, last_a);
            finish(l, iteration, residual / solve.reference, end.converged, end.breakdown);
            return;
        }
        auto value = [&](uint j) { return l.vectors[PRECONDITIONED][j]; };
        for_rows(s, l, window, value, [&](uint i, bool is_free, const real4& own, const vec3& row) {
            Kept kept = iterates.load(i, iteration);
            vec3 p = xyz(own), image = filtered(l, i, is_free, row), q = image;
            products[i] = dot(p, image);
            vec3 y = last_a * xyz(kept.p) + Iterates::solution(kept);
            if (b != 0) {
                p = p + b * xyz(kept.p);
                q = q + b * xyz(kept.q);
            }
            iterates.p[i] = with_w(p, y.x);
            iterates.q[i] = with_w(q, y.y);
            iterates.y[i] = y.z;
        });
        double delta, unused, beta;
        products_add(s, l, memory, 1, [&](uint i) { return Products{products[i], 0}; }, delta, unused);
        if (!recurrence.advance(gamma, delta, beta)) {
            solution_write(iteration, false, 0);
            finish(l, iteration, residual / solve.reference, end.converged, iteration == 0, true);
            return;
        }
        real a = (real)recurrence.alpha;
        double* sums[2] = {l.partials + units, l.partials + 2 * units};
        Pass::for_particles(s, memory, 2, sums[0], sums[1], [&](uint i) {
            vec3 r = (-a) * xyz(iterates.q[i]) + xyz(l.vectors[RESIDUAL][i]);
            return Pass::residual_store(s, l, i, r, 0);
        });
        Pass::residual_sums(s, l, memory, sums, residual, gamma);
    }
}

extern "C" __global__ void __launch_bounds__(THREADS, SOLVER_BLOCKS) jacobi(const __grid_constant__ Solver s, const __grid_constant__ Linear l, double tolerance, uint iterations_max, uint from_solution) {
    extern __shared__ real4 window[];
    __shared__ Sums memory;
    Solve solve = begin(s, l, memory, from_solution);
    if (!solve.iterates) return;
    // Tiles take the step of y themselves, all that they reach. So what is read and what is written change places in each
    // iteration.
    real4 *y = l.vectors[SOLUTION], *next_y = l.vectors[DIRECTION];
    real4 *c = l.vectors[PRECONDITIONED], *next_c = l.vectors[DIRECTION_IMAGE];
    Products* products = (Products*)l.vectors[IMAGE];
    Damping damping = {1, 0};
    double norm = solve.gamma, residual = solve.residual;
    for (uint iteration = 0;; iteration++) {
        End end(solve, tolerance, residual, norm, iteration == iterations_max);
        bool goes_on = !end.is_reached;
        if (goes_on) {
            real w = (real)damping.omega;
            auto value = [&](uint j) { return with_w(w * xyz(c[j]) + xyz(y[j]), 0); };
            for_rows(s, l, window, value, [&](uint i, bool is_free, const real4& own, const vec3& row) {
                vec3 r = filtered(l, i, is_free, xyz(l.vectors[RIGHT_SIDE][i]) - row);
                vec3 change = filtered(l, i, is_free, preconditioned(l, i, r));
                next_y[i] = own;
                next_c[i] = with_w(change, 0);
                products[i] = {dot(r, change), dot(r, r)};
            });
            real4 *last_y = y, *last_c = c;
            y = next_y;
            c = next_c;
            next_y = last_y;
            next_c = last_c;
            double before = norm, square;
            products_add(s, l, memory, 2, [&](uint i) { return products[i]; }, norm, square);
            residual = sqrt(square);
            goes_on = damping.advance(before, norm);
        }
        if (!goes_on) {
            Pass::Work work = Pass::work_of(s.count);
            for (uint k = 0; y != l.vectors[SOLUTION] && k < work.count; k++) {
                uint i = work.particle(k);
                if (i < s.count) l.vectors[SOLUTION][i] = y[i];
            }
            finish(l, iteration, residual / solve.reference, end.converged, end.breakdown);
            return;
        }
    }
}
