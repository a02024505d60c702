// NUMERICS section 5, the preconditioner `schwarz`: inverses of the blocks of groups of particles, and a V-cycle over groups of
// groups. Each sum has the order of `cloth_core::schwarz`. A block of 96 unknowns is worked on by a team of as many threads.
// Vectors of a level are written by one pass over the whole grid and read by the next.

#define TEAM 96
// Unknowns that a chunk of a row of a factor has, of a node, of a run of nodes that is smoothed at once.
#define CHUNK 16
#define NODE 6
#define CLUSTER 8
#define LEVELS_MAX 8

// Nodes of a level: starts, columns and blocks of the rows of their matrix; rows and scale of the inverse factors of runs of 16 of them, or
// of all on the last level; what unit unknowns of a group do to each node, and where the nodes of each group start.
struct SchwarzLevel {
    const uint* rows;
    const uint* columns;
    const double* blocks;
    const float* factors;
    const double* scale;
    const double* prolongation;
    const uint* groups;
    double* right_side;
    // Before and after the second smoothing; the last level has the second one alone.
    double* solution[2];
    double weight;
    uint count;
    uint group_count;
};

struct Schwarz {
    // Particles, those of a group one after the other; where groups start, and the rows of their factors; of each particle place and group.
    const uint* order;
    const uint* group_starts;
    const ulong* row_starts;
    const uint* places;
    const uint* group_of;
    const float* factors;
    const real* scale;
    const float* prolongation;
    uint group_count;
    uint level_count;
    SchwarzLevel levels[LEVELS_MAX];
};

static_assert(sizeof(Schwarz) == 72 + LEVELS_MAX * 96, "`schwarz.rs` of the backend has another layout");

// Where row k of a factor starts: row j has j / 16 + 1 chunks.
__device__ __forceinline__ uint factor_row(uint k) {
    uint whole = k / CHUNK;
    return CHUNK * (CHUNK * whole * (whole + 1) / 2 + k % CHUNK * (whole + 1));
}

// Numbers of a whole factor.
#define FACTOR (CHUNK * CHUNK * (TEAM / CHUNK) * (TEAM / CHUNK + 1) / 2)
// Rows that a half warp works on at once.
#define FACTOR_ROWS 4

// What a team of threads works with.
struct TeamMemory {
    uint4 factor[FACTOR / 4];
    double scaled[TEAM];
    double products[TEAM];
    real plain[TEAM];
};

// Brings the factor of a block near, all of it at once.
__device__ __forceinline__ void factor_load(TeamMemory& memory, const float* rows, uint size, uint t) {
    const uint4* from = (const uint4*)rows;
    uint count = factor_row(size) / 4;
#pragma unroll 7
    for (uint at = t; at < count; at += TEAM) memory.factor[at] = __ldg(&from[at]);
}

// Entry t of the sum over k of w_k w_k^T times the vector `scaled`, by a team of `width` threads that has room for `products`. All threads of
// the block are here.
template <typename Number>
__device__ __forceinline__ Number factor_times(const float* rows, uint size, uint t, uint width, const Number* scaled, Number* products) {
    uint half = t / CHUNK, lane = t % CHUNK, halves = width / CHUNK;
    for (uint first = 0; first < size; first += FACTOR_ROWS * halves) {
        Number sums[FACTOR_ROWS] = {};
        uint chunks = (min(first + FACTOR_ROWS * halves, size) + CHUNK - 1) / CHUNK;
#pragma unroll 2
        for (uint chunk = 0; chunk < chunks; chunk++) {
            Number x = scaled[chunk * CHUNK + lane];
#pragma unroll
            for (uint row = 0; row < FACTOR_ROWS; row++) {
                uint k = first + row * halves + half;
                if (k < size && chunk <= k / CHUNK) sums[row] += (Number)rows[factor_row(k) + chunk * CHUNK + lane] * x;
            }
        }
#pragma unroll
        for (uint row = 0; row < FACTOR_ROWS; row++) {
            Number sum = sums[row];
            for (uint distance = CHUNK / 2; distance > 0; distance /= 2) sum = sum + __shfl_xor_sync(ALL_LANES, sum, distance);
            uint k = first + row * halves + half;
            if (lane == 0 && k < size) products[k] = sum;
        }
    }
    __syncthreads();
    Number sum = 0;
    if (t < size) {
        for (uint first = t / CHUNK * CHUNK; first < size; first += CHUNK) {
            const float* entry = rows + factor_row(first) + t;
#pragma unroll
            for (uint k = 0; k < CHUNK; k++) {
                if (first + k < size) sum += (Number)entry[k * (first + CHUNK)] * products[first + k];
            }
        }
    }
    return sum;
}

// The same with the factor in the memory of a team, whose threads have put it there, and the vector.
template <typename Number>
__device__ __forceinline__ Number factor_times(TeamMemory& memory, uint size, uint t) {
    __syncthreads();
    return factor_times((const float*)memory.factor, size, t, TEAM, (const Number*)memory.scaled, (Number*)memory.products);
}

// Entry k of the residual of a node.
__device__ __forceinline__ double node_residual(const SchwarzLevel& level, const double* x, uint node, uint k) {
    double sum = 0, given = level.right_side[NODE * (size_t)node + k];
    uint end = __ldg(&level.rows[node + 1]);
#pragma unroll 4
    for (uint at = __ldg(&level.rows[node]); at < end; at++) {
        const double* block = level.blocks + NODE * NODE * (size_t)at + NODE * k;
        const double* other = x + NODE * (size_t)__ldg(&level.columns[at]);
#pragma unroll
        for (uint c = 0; c < NODE; c++) sum += __ldg(&block[c]) * other[c];
    }
    return given - sum;
}

// Teams of a block: as much shared memory as every GPU gives.
#define TEAMS 4

// The passes of one application, with memory for each team.
struct SchwarzPasses {
    const Schwarz& p;
    ulong* barrier;
    TeamMemory& memory;
    uint team, t;

    // Threads beyond the last team are in the place of others and do nothing.
    __device__ __forceinline__ SchwarzPasses(const Schwarz& schwarz, ulong* of_grid, unsigned char* shared)
        : p(schwarz),
          barrier(of_grid),
          memory(((TeamMemory*)shared)[threadIdx.x / TEAM % TEAMS]),
          team(threadIdx.x / TEAM),
          t(threadIdx.x % TEAM) {}

    // The task of this team, of those that the block takes in a step; `count` if it has none.
    __device__ __forceinline__ uint task(uint first, uint count) const { return team < TEAMS ? min(first + team, count) : count; }

    // What the factors of groups make of a vector, and P^T of it.
    __device__ __forceinline__ void groups(const real4* from, real4* to) const {
        for (uint first = blockIdx.x * TEAMS; first < p.group_count; first += gridDim.x * TEAMS) {
            uint group = task(first, p.group_count), start = 0, size = 0;
            if (group < p.group_count) {
                start = 3 * p.group_starts[group];
                size = 3 * p.group_starts[group + 1] - start;
                factor_load(memory, p.factors + p.row_starts[group], size, t);
            }
            real value = 0, scale = 0, *plain = memory.plain;
            uint particle = 0;
            if (t < size) {
                particle = p.order[(start + t) / 3];
                value = component(xyz(from[particle]), t % 3);
                scale = p.scale[start + t];
            }
            if (team < TEAMS) {
                ((real*)memory.scaled)[t] = scale * value;
                plain[t] = value;
            }
            real sum = factor_times<real>(memory, size, t);
            if (t < size) ((real*)&to[particle])[t % 3] = scale * sum;
            // P^T of it: a particle for each lane, two modes for each warp.
            uint lane = t % WARP;
            for (uint k = t / WARP * 2, end = k + 2; k < end; k++) {
                double sum = 0;
                if (3 * lane < size) {
                    const float* column = p.prolongation + NODE * ((size_t)start + 3 * lane) + k;
                    for (uint axis = 0; axis < 3; axis++) sum += (double)column[NODE * axis] * (double)plain[3 * lane + axis];
                }
                sum = sum_of_warp(sum);
                if (lane == 0 && size > 0) p.levels[0].right_side[NODE * (size_t)group + k] = sum;
            }
            __syncthreads();
        }
    }

    // x = w Z r for the unknowns of the runs that `residual` gives r of, x + w Z r with `adds`; `done` takes x.
    template <typename Residual, typename Done>
    __device__ __forceinline__ void smooth(const SchwarzLevel& level, bool adds, Residual residual, Done done) const {
        uint unknowns = NODE * level.count, runs = (unknowns + TEAM - 1) / TEAM;
        for (uint first = blockIdx.x * TEAMS; first < runs; first += gridDim.x * TEAMS) {
            uint run = task(first, runs), start = run * TEAM, size = run < runs ? min((uint)TEAM, unknowns - start) : 0;
            if (size > 0) factor_load(memory, level.factors + (size_t)run * FACTOR, size, t);
            double scale = 0, value = 0;
            if (t < size) {
                scale = level.scale[start + t];
                value = scale * residual(start + t);
            }
            if (team < TEAMS) memory.scaled[t] = value;
            double sum = factor_times<double>(memory, size, t);
            double x = level.weight * (scale * sum) + (adds && t < size ? level.solution[0][start + t] : 0.0);
            // Nobody needs the vector any more.
            if (t < size) memory.scaled[t] = x;
            __syncthreads();
            done(start, size, x, memory.scaled);
            __syncthreads();
        }
    }

    // x += P of the unknowns of nodes of the level above, `x` of them from number `start` on, by `threads` threads.
    __device__ __forceinline__ void prolong(const SchwarzLevel& below, uint start, uint size, const double* x, uint thread, uint threads) const {
        uint first = start / NODE, last = first + size / NODE;
        if (first == last) return;
        uint begin = NODE * __ldg(&below.groups[first]), end = NODE * __ldg(&below.groups[last]), node = first;
        for (uint at = begin + thread; at < end; at += threads) {
            while (NODE * __ldg(&below.groups[node + 1]) <= at) node++;
            const double* row = below.prolongation + NODE * (size_t)at;
            const double* own = x + NODE * (node - first);
            double sum = 0;
#pragma unroll
            for (uint k = 0; k < NODE; k++) sum = sum + __ldg(&row[k]) * own[k];
            below.solution[0][at] += sum;
        }
    }

    // The residual of all nodes as the right-hand side of their groups: two groups for each team.
    __device__ __forceinline__ void restrict_to(const SchwarzLevel& level, const SchwarzLevel& above) const {
        constexpr uint HALF = NODE * CLUSTER;
        uint half = t / HALF, u = t % HALF;
        double *own = memory.scaled + half * HALF, *of_nodes = memory.products + half * HALF;
        for (uint first = blockIdx.x * 2 * TEAMS; first < level.group_count; first += gridDim.x * 2 * TEAMS) {
            uint group = team < TEAMS ? first + 2 * team + half : level.group_count;
            uint start = 0, size = 0;
            if (group < level.group_count) {
                start = level.groups[group];
                size = NODE * (level.groups[group + 1] - start);
            }
            if (u < size) own[u] = node_residual(level, level.solution[0], start + u / NODE, u % NODE);
            __syncthreads();
            // Of each node, then of all.
            double sum = 0;
            if (u < size) {
                const double* column = level.prolongation + NODE * NODE * (size_t)(start + u / NODE) + u % NODE;
                const double* of_node = own + u / NODE * NODE;
                for (uint k = 0; k < NODE; k++) sum += column[NODE * k] * of_node[k];
                of_nodes[u] = sum;
            }
            __syncthreads();
            if (u < NODE && size > 0) {
                sum = 0;
                for (uint k = u; k < size; k += NODE) sum += of_nodes[k];
                above.right_side[NODE * (size_t)group + u] = sum;
            }
            __syncthreads();
        }
    }

    // The first smoothing of levels up to `end`, and what it leaves as right-hand side of the next ones.
    __device__ __forceinline__ void down(uint end) const {
        for (uint k = 0; k < end; k++) {
            const SchwarzLevel& level = p.levels[k];
            smooth(
                level, false, [&](uint at) { return level.right_side[at]; },
                [&](uint start, uint size, double x, const double*) {
                    if (t < size) level.solution[0][start + t] = x;
                });
            grid_barrier(barrier);
            restrict_to(level, p.levels[k + 1]);
            grid_barrier(barrier);
        }
    }

    // The second smoothing of levels from `end` down, of which each gives its share to the one below.
    __device__ __forceinline__ void up(uint end) const {
        for (uint k = end; k > 0; k--) {
            const SchwarzLevel& level = p.levels[k - 1];
            smooth(
                level, true, [&](uint at) { return node_residual(level, level.solution[0], at / NODE, at % NODE); },
                [&](uint start, uint size, double x, const double* own) {
                    if (t < size) level.solution[1][start + t] = x;
                    if (k > 1) prolong(p.levels[k - 2], start, size, own, t, TEAM);
                });
            grid_barrier(barrier);
        }
    }

    // The last level, which one block of all its threads solves; its factor is too large to be near.
    __device__ __forceinline__ void bottom(const SchwarzLevel& level, const SchwarzLevel* below, double* shared, uint threads) const {
        if (blockIdx.x > 0) return;
        double *scaled = shared, *products = shared + threads;
        uint size = NODE * level.count, u = threadIdx.x;
        double scale = u < size ? level.scale[u] : 0;
        scaled[u] = u < size ? scale * level.right_side[u] : 0;
        __syncthreads();
        double x = scale * factor_times<double>(level.factors, size, u, threads, scaled, products);
        __syncthreads();
        scaled[u] = x;
        if (u < size) level.solution[1][u] = x;
        __syncthreads();
        if (below) prolong(*below, 0, size, scaled, u, threads);
    }

    // All that comes before `schwarz_of`, by blocks of so many threads.
    __device__ __forceinline__ void apply(const real4* from, real4* to, unsigned char* shared, uint threads) const {
        groups(from, to);
        grid_barrier(barrier);
        uint last = p.level_count - 1;
        down(last);
        bottom(p.levels[last], last > 0 ? &p.levels[last - 1] : nullptr, (double*)shared, threads);
        grid_barrier(barrier);
        up(last);
    }
};

// P^-1 of a vector for a particle, from what `SchwarzPasses::apply` has left: unfiltered.
__device__ __forceinline__ vec3 schwarz_of(const Schwarz& p, const real4& local, uint i) {
    const double* coarse = p.levels[0].solution[1] + NODE * (size_t)p.group_of[i];
    const float* rows = p.prolongation + 3 * NODE * (size_t)p.places[i];
    double sums[3];
    for (uint axis = 0; axis < 3; axis++) {
        double sum = 0;
        for (uint k = 0; k < NODE; k++) sum = sum + (double)rows[NODE * axis + k] * coarse[k];
        sums[axis] = sum;
    }
    return {local.x + (real)sums[0], local.y + (real)sums[1], local.z + (real)sums[2]};
}
