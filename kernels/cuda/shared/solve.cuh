// NUMERICS section 5, `conjugate_gradient` and `jacobi`: what all forms of the solvers have in common, whose blocks
// are all resident. What a solve does once or twice is no part of the code of its iterations, which takes a compiler long enough.

struct Solve {
    double reference;
    double residual;
    // r . c
    double gamma;
    // How much closer the first solution is than z in the square of the norm of the energy, if that is measured.
    double closer;
    // Whether there is something to do.
    bool iterates;
};

// What a particle adds to one sum or two.
struct Products {
    real a;
    real b;
};

#define NOT_A_NUMBER (__longlong_as_double(0x7ff8000000000000ll))

__device__ __forceinline__ void finish(const Linear& l, uint iterations, double residual, bool converged, bool breakdown, bool indefinite = false, double energy = NOT_A_NUMBER) {
    if (blockIdx.x + threadIdx.x > 0) return;
    l.outcome->energy = energy;
    l.outcome->indefinite = indefinite;
    l.outcome->iterations = iterations;
    l.outcome->residual = residual;
    l.outcome->converged = converged;
    l.outcome->breakdown = breakdown;
}

__device__ __forceinline__ bool is_finite(double a) { return fabs(a) <= 1.7976931348623157e308; }

// Whether a solve ends, and how.
struct End {
    bool converged;
    bool breakdown;
    bool is_reached;

    // With |r|, r . c, and whether there are no iterations left.
    __device__ __forceinline__ End(const Solve& solve, double tolerance, double residual, double gamma, bool is_last)
        : End(residual <= tolerance * solve.reference, residual, gamma, is_last) {}

    __device__ __forceinline__ End(bool is_good, double residual, double gamma, bool is_last) {
        converged = is_good;
        breakdown = !(is_finite(residual) && is_finite(gamma));
        is_reached = converged || breakdown || gamma == 0 || is_last;
    }
};

#define ENERGY_TERMS 64
#define ENERGY_TAIL_MIN 4

// The error in the norm of the energy, as `EnergyEstimate` of cloth-core has it, in shared memory: one thread of each block works it out.
struct EnergyEstimate {
    double sums[ENERGY_TERMS];
    double before;
    // Not a number before there were enough iterations.
    double relative;
    uint stride, filled, last;

    __device__ __forceinline__ void begin(double closer) {
        before = closer;
        relative = NOT_A_NUMBER;
        stride = 1;
        filled = last = 0;
    }

    __device__ __forceinline__ double sum(uint first, uint end) const {
        double all = 0;
        for (uint k = first; k < end; k++) all += sums[k];
        return all;
    }

    // Adds the term alpha gamma of an iteration.
    __device__ __forceinline__ void add(double term) {
        if (filled == 0 || last == stride) {
            if (filled == ENERGY_TERMS) {
                for (uint pair = 0; pair < ENERGY_TERMS / 2; pair++) sums[pair] = sums[2 * pair] + sums[2 * pair + 1];
                filled = ENERGY_TERMS / 2;
                stride *= 2;
            }
            sums[filled++] = 0;
            last = 0;
        }
        sums[filled - 1] += term;
        last++;
        uint tail = max((filled + 3) / 4, (uint)ENERGY_TAIL_MIN);
        if (filled <= tail) return;
        double share = sum(filled - tail, filled) / (fmax(before, 0.0) + sum(0, filled));
        relative = share >= 0 ? sqrt(share) : NOT_A_NUMBER;
    }
};

// How the conjugate gradient method goes on: step length and share of the last direction.
struct Recurrence {
    double alpha;
    double gamma;

    // How much of the last direction goes into the next.
    __device__ __forceinline__ double share(double next_gamma) const { return alpha != 0 ? next_gamma / gamma : 0; }

    // Whether the curvature along the direction is positive.
    __device__ __forceinline__ bool advance(double next_gamma, double delta, double& beta) {
        beta = share(next_gamma);
        double curvature = alpha != 0 ? delta - beta * next_gamma / alpha : delta;
        double next = next_gamma / curvature;
        if (!(curvature > 0 && is_finite(next))) return false;
        alpha = next;
        gamma = next_gamma;
        return true;
    }
};

#define HALVINGS_MAX 20

// How the Jacobi method goes on.
struct Damping {
    double omega;
    uint halvings;

    // Whether it goes on at all after r . c was `norm` and is `next`.
    __device__ __forceinline__ bool advance(double norm, double next) {
        if (!(next >= norm)) return true;
        if (halvings == HALVINGS_MAX) return false;
        halvings++;
        omega *= 0.5;
        return true;
    }
};

// Passes over all particles by blocks with `Memory` for sums: particles are handed out in steps, each to a team of threads, which work
// out its row together; its first thread does all else.
template <typename Memory> struct Passes {
    static constexpr uint STEP = Memory::STEP;
    static constexpr uint MEMBERS = Memory::MEMBERS;
    static constexpr uint THREADS = Memory::THREADS;

    // The steps of a block.
    struct Work {
        uint first;
        uint stride;
        uint count;

        __device__ __forceinline__ uint step(uint k) const { return first + k * stride; }
        __device__ __forceinline__ uint particle(uint k) const { return step(k) * STEP + threadIdx.x / MEMBERS; }
    };

    static __device__ __forceinline__ bool is_first() { return threadIdx.x % MEMBERS == 0; }

    // Calls `visit` for each particle of this thread.
    template <typename Visit> static __device__ __forceinline__ void for_own(uint count, Visit visit) {
        Work work = work_of(count);
        for (uint k = 0; k < work.count; k++) {
            uint i = work.particle(k);
            if (i < count && is_first()) visit(i);
        }
    }

    static __device__ __forceinline__ Work work_of(uint count) {
        uint steps = (count + STEP - 1) / STEP;
        return {blockIdx.x, gridDim.x, (steps - blockIdx.x + gridDim.x - 1) / gridDim.x};
    }

    // Sums that are published, those of particles beyond the last included.
    static __device__ __forceinline__ uint units_of(uint count) { return (count + STEP - 1) / STEP * Memory::UNITS; }

    // Calls `visit` for each particle of this block; its products are summed.
    template <typename Visit>
    static __device__ __forceinline__ void for_particles(const Solver& s, Memory& memory, uint count, double* first, double* second, Visit visit) {
        for_teams(s, memory, count, first, second, [&](uint i) {
            if (i < s.count && is_first()) return visit(i);
            return Products{0, 0};
        });
    }

    // The same with its origin and its row of A times a vector.
    template <typename Visit>
    static __device__ __forceinline__ void for_rows(const Solver& s, const Linear& l, Memory& memory, const real4* vector, uint count, double* first, double* second, Visit visit) {
        if (l.has_contacts && l.contacts.terms != nullptr) {
            contact_terms(l.contacts, vector);
            grid_barrier(&s.status->barrier[1]);
        }
        for_teams(s, memory, count, first, second, [&](uint i) {
            // All lanes of a warp have to be there.
            uint j = MEMBERS > 1 ? min(i, s.count - 1) : i;
            if (MEMBERS == 1 && i >= s.count) return Products{0, 0};
            real4 origin = l.origin[j];
            vec3 row = matrix_row<MEMBERS, true>(s, l, vector, j, origin);
            if (i < s.count && is_first()) return visit(i, origin, row);
            return Products{0, 0};
        });
    }

    // Calls `visit` in all threads of each step of this block, steps in descending order: the pass before it has ended with those that are still in
    // the cache. Its products are summed.
    template <typename Visit>
    static __device__ __forceinline__ void for_teams(const Solver& s, Memory& memory, uint count, double* first, double* second, Visit visit) {
        Work work = work_of(s.count);
        for (uint end = work.count; end > 0;) {
            uint turns = min(end, Memory::TURNS);
            for (uint turn = 0; turn < turns; turn++) {
                Products products = visit(work.particle(end - 1 - turn));
                for (uint which = 0; which < count; which++) memory.put(turn, which, which == 0 ? products.a : products.b);
            }
            __syncthreads();
            memory.finish(turns, count, first, second, work.step(end - 1), -(int)work.stride);
            __syncthreads();
            end -= turns;
        }
    }

    // |r| and r . c from what `for_particles` has put into `sums`.
    static __device__ __forceinline__ void residual_sums(const Solver& s, const Linear& l, Memory& memory, double* const* sums, double& residual, double& gamma) {
        grid_barrier(&s.status->barrier[1]);
        double square;
        memory.add_blocks(2, sums[0], sums[1], units_of(s.count), gamma, square);
        residual = sqrt(square);
#ifdef CLOTH_SCHWARZ
        precondition(s, l, memory, RESIDUAL, PRECONDITIONED, sums[0]);
        grid_barrier(&s.status->barrier[1]);
        double unused;
        memory.add_blocks(1, sums[0], sums[0], units_of(s.count), gamma, unused);
#endif
    }

#ifdef CLOTH_SCHWARZ
    // to = S P^-1 from of whole vectors, which all blocks have written; their products go into `sums`.
    static __device__ __noinline__ void precondition(const Solver& s, const Linear& l, Memory& memory, uint from, uint to, double* sums) {
        // Its addresses are asked for again after each meeting of the blocks.
        __shared__ Schwarz near;
        for (uint word = threadIdx.x; word < sizeof(Schwarz) / sizeof(uint); word += THREADS) ((uint*)&near)[word] = ((const uint*)l.schwarz)[word];
        __syncthreads();
        SchwarzPasses(near, &s.status->barrier[1], frame_memory).apply(l.vectors[from]);
        for_particles(s, memory, 1, sums, sums, [&](uint i) {
            vec3 given = xyz(l.vectors[from][i]);
            vec3 c = ::filtered(s, l, i, schwarz_of(*l.schwarz, preconditioned(l, i, given), i));
            l.vectors[to][i] = with_w(c, 0);
            return Products{dot(given, c), 0};
        });
    }
#endif

    // Stores r with a number beside it, and c = S P^-1 r.
    static __device__ __forceinline__ Products residual_store(const Solver& s, const Linear& l, uint i, const vec3& r, real beside) {
#ifdef CLOTH_SCHWARZ
        // c is a matter of all particles.
        l.vectors[RESIDUAL][i] = with_w(r, beside);
        return Products{0, dot(r, r)};
#endif
        vec3 c = preconditioned(l, i, r);
        // Without colliders the filter keeps held particles alone, whose r is zero.
        if (l.has_constraints) c = ::filtered(s, l, i, c);
        l.vectors[RESIDUAL][i] = with_w(r, beside);
        l.vectors[PRECONDITIONED][i] = with_w(c, 0);
        return Products{dot(r, c), dot(r, r)};
    }

    // r = S (b - A y) and c = S P^-1 r for a vector y whose entries all blocks have written, or r = S b without
    // one; then |r| and r . c.
    static __device__ __noinline__ void residual_of(const Solver& s, const Linear& l, Memory& memory, const real4* y, double& residual, double& gamma) {
        uint units = units_of(s.count);
        double* sums[2] = {l.partials + units, l.partials + 2 * units};
        auto visit = [&](uint i, const real4& origin, const vec3& row) {
            bool is_free = origin.w > 0;
            vec3 r = filtered(l, i, is_free, xyz(l.vectors[RIGHT_SIDE][i]) - row);
            l.vectors[RESIDUAL][i] = with_w(r, 0);
#ifdef CLOTH_SCHWARZ
            return Products{0, dot(r, r)};
#else
            vec3 c = filtered(l, i, is_free, preconditioned(l, i, r));
            l.vectors[PRECONDITIONED][i] = with_w(c, 0);
            return Products{dot(r, c), dot(r, r)};
#endif
        };
        if (y == nullptr) {
            for_particles(s, memory, 2, sums[0], sums[1], [&](uint i) { return visit(i, l.origin[i], vec3{0, 0, 0}); });
        } else {
            for_rows(s, l, memory, y, 2, sums[0], sums[1], visit);
        }
        residual_sums(s, l, memory, sums, residual, gamma);
    }

    // (y - z) r, z as the direction.
    static __device__ __forceinline__ double step_times_residual(const Solver& s, const Linear& l, Memory& memory) {
        uint units = units_of(s.count);
        double* sums[2] = {l.partials + units, l.partials + 2 * units};
        for_particles(s, memory, 2, sums[0], sums[1], [&](uint i) {
            vec3 r = xyz(l.vectors[RESIDUAL][i]);
            return Products{dot(xyz(l.vectors[SOLUTION][i]), r), l.has_constraints ? dot(xyz(l.vectors[DIRECTION][i]), r) : (real)0};
        });
        grid_barrier(&s.status->barrier[1]);
        double of_solution, of_start;
        memory.add_blocks(2, sums[0], sums[1], units, of_solution, of_start);
        // Nobody writes sums while others add them.
        grid_barrier(&s.status->barrier[1]);
        return of_solution - of_start;
    }

    // Puts the solution where the iteration starts, and its residual with it.
    static __device__ __noinline__ Solve begin(const Solver& s, const Linear& l, Memory& memory, uint from_solution, bool measures = false) {
        uint units = units_of(s.count);
        bool is_constrained = false;
        if (l.has_constraints) {
            for_particles(s, memory, 1, l.partials, l.partials, [&](uint i) {
                vec3 z = projected(s, l, i, vec3{0, 0, 0});
                l.vectors[DIRECTION][i] = with_w(z, 0);
                return Products{dot(z, z), 0};
            });
            grid_barrier(&s.status->barrier[1]);
            double square, unused;
            memory.add_blocks(1, l.partials, l.partials, units, square, unused);
            is_constrained = square != 0;
        }
        Solve solve;
        solve.closer = 0;
        residual_of(s, l, memory, is_constrained ? l.vectors[DIRECTION] : nullptr, solve.reference, solve.gamma);
        solve.residual = solve.reference;
        solve.iterates = true;
        if (solve.reference == 0 || !from_solution) {
            for_own(s.count, [&](uint i) { l.vectors[SOLUTION][i] = l.has_constraints ? l.vectors[DIRECTION][i] : real4{0, 0, 0, 0}; });
        }
        if (solve.reference == 0) {
            finish(l, 0, 0, true, false);
            solve.iterates = false;
            return solve;
        }
        if (from_solution) {
            for_own(s.count, [&](uint i) { l.vectors[SOLUTION][i] = with_w(projected(s, l, i, xyz(l.vectors[SOLUTION][i])), 0); });
            grid_barrier(&s.status->barrier[1]);
            if (measures) solve.closer += step_times_residual(s, l, memory);
            residual_of(s, l, memory, l.vectors[SOLUTION], solve.residual, solve.gamma);
            if (measures) solve.closer += step_times_residual(s, l, memory);
        }
        if (!(is_finite(solve.reference) && is_finite(solve.residual))) {
            finish(l, 0, 1.0 / 0.0, false, true);
            solve.iterates = false;
        }
        return solve;
    }
};

// Of all kernels of solvers. With `teams`, for models that do not fill the device with a thread for each particle, several threads work out a row together.
#define SOLVER_THREADS 512
#if defined(CLOTH_F64) || defined(CLOTH_TEAMS) || defined(CLOTH_SCHWARZ)
#define SOLVER_BLOCKS 1
#else
#define SOLVER_BLOCKS 2
#endif

#ifdef CLOTH_SCHWARZ
// What is left beside the memory of teams.
typedef SumMemory<SOLVER_THREADS, 2> SolverSums;
#elif defined(CLOTH_TEAMS)
typedef SumMemory<SOLVER_THREADS / ROW_TEAM, 2, ROW_TEAM> SolverSums;
#else
typedef SumMemory<SOLVER_THREADS> SolverSums;
#endif
typedef Passes<SolverSums> SolverPasses;
