// NUMERICS section 5, the preconditioner `schwarz`: what rigid motions of groups of particles add to `block`, by a V-cycle over groups of
// groups. Each sum has the order of `cloth_core::schwarz`. A block of up to 96 unknowns of a run of nodes is worked on by a team of four warps, which has its
// factor in registers. Vectors of a level are written by one pass over the whole grid and read by the next.

// Threads of a team, and the unknowns of a block at most.
#define TEAM 128
#define UNKNOWNS 96
// Unknowns that a chunk of a row of a factor has, and of a node; nodes of a group.
#define CHUNK 16
#define NODE 6
#define CLUSTER 8
#define LEVELS_MAX 8

// Nodes of a level: starts, columns and blocks of the rows of their matrix, each block column by column; rows and scale of the inverse factors of runs of
// 16 of them; what unit unknowns of a group do to each node, where the nodes of each group start, and the group of each. The last level
// has the inverse of its matrix, row by row, in place of factors and groups.
struct SchwarzLevel {
    const uint* rows;
    const uint* columns;
    const double* blocks;
    const float* factors;
    const double* scale;
    const double* prolongation;
    const uint* groups;
    const uint* group_of;
    const double* inverse;
    double* right_side;
    // Before and after the second smoothing; the last level has the second one alone.
    double* solution[2];
    double weight;
    uint count;
    uint group_count;
};

struct Schwarz {
    // Particles, those of a group one after the other; where groups start; of each particle place and group.
    const uint* order;
    const uint* group_starts;
    const uint* places;
    const uint* group_of;
    const float* prolongation;
    uint group_count;
    uint level_count;
    SchwarzLevel levels[LEVELS_MAX];
};

static_assert(sizeof(Schwarz) == 48 + LEVELS_MAX * 112, "`schwarz.rs` of the backend has another layout");

// Where row k of a factor starts: row j has j / 16 + 1 chunks.
__device__ __forceinline__ uint factor_row(uint k) {
    uint whole = k / CHUNK;
    return CHUNK * (CHUNK * whole * (whole + 1) / 2 + k % CHUNK * (whole + 1));
}

// Numbers of a whole factor.
#define FACTOR (CHUNK * CHUNK * (UNKNOWNS / CHUNK) * (UNKNOWNS / CHUNK + 1) / 2)
// Rows of a factor are handed out to so many half warps: row k to number k % 8.
#define HALVES (TEAM / CHUNK)
#define HALF_ROWS (UNKNOWNS / HALVES)

// The half warp of a thread of a team: so that the first step of a tree over all of them is one within a warp.
__device__ __forceinline__ uint half_of(uint t) { return t / WARP + HALVES / 2 * (t % WARP / CHUNK); }

// What a team of threads works with.
struct TeamMemory {
    double scaled[UNKNOWNS];
    double partial[TEAM / WARP][UNKNOWNS];
};

// Sums over the 16 lanes of a half warp, as trees, of the numbers that `row` gives of rows: lane k gets that of row k. Each step of the trees halves the rows that
// a lane goes on with, and few numbers are there at a time.
template <typename Number, uint DISTANCE = 1, typename Row> __device__ __forceinline__ Number lane_sums(Row row, uint first = 0) {
    if constexpr (DISTANCE == CHUNK) {
        return first < HALF_ROWS ? row(first) : (Number)0;
    } else {
        Number lower = lane_sums<Number, 2 * DISTANCE>(row, first), upper = lane_sums<Number, 2 * DISTANCE>(row, first + DISTANCE);
        bool is_upper = threadIdx.x & DISTANCE;
        return (is_upper ? upper : lower) + __shfl_xor_sync(ALL_LANES, is_upper ? lower : upper, DISTANCE);
    }
}

// The rows of a factor that a half warp has, one number of each chunk for each lane: those of a block of 16 rows have one chunk more than those before.
struct FactorRows {
    float numbers[HALF_ROWS / 2 * (HALF_ROWS / 2 + 1)];

    // Where those of a row begin, each second of which has one more than the one before it.
    static __device__ __forceinline__ uint row_at(uint row) { return row / 2 * (row / 2 + 1) + row % 2 * (row / 2 + 1); }

    // Starts to read them; nothing waits before they are used.
    __device__ __forceinline__ void load(const float* rows, uint t) {
        uint half = half_of(t);
#pragma unroll
        for (uint row = 0; row < HALF_ROWS; row++) {
            // Of the block of 16 rows that row number 8 row + half is in, the first or the second half.
            uint block = row / 2;
            const float* own = rows + CHUNK * (CHUNK * block * (block + 1) / 2 + row % 2 * HALVES * (block + 1)) + (CHUNK * (block + 1) * half + t % CHUNK);
#pragma unroll
            for (uint chunk = 0; chunk <= block; chunk++) numbers[row_at(row) + chunk] = __ldg(&own[chunk * CHUNK]);
        }
    }

    // What this half warp adds to the sum of w_k w_k^T times a vector, for its entries that this lane has. Rows behind the last one are zeros.
    template <typename Number> __device__ __forceinline__ void times(const Number* vector, uint t, Number (&out)[UNKNOWNS / CHUNK]) const {
        Number own[UNKNOWNS / CHUNK];
#pragma unroll
        for (uint chunk = 0; chunk < UNKNOWNS / CHUNK; chunk++) {
            own[chunk] = vector[chunk * CHUNK + t % CHUNK];
            out[chunk] = 0;
        }
        Number products = lane_sums<Number>([&](uint row) {
            Number sum = 0;
#pragma unroll
            for (uint chunk = 0; chunk <= row / 2; chunk++) sum += (Number)numbers[row_at(row) + chunk] * own[chunk];
            return sum;
        });
#pragma unroll
        for (uint row = 0; row < HALF_ROWS; row++) {
            Number product = __shfl_sync(ALL_LANES, products, t % WARP / CHUNK * CHUNK + row);
#pragma unroll
            for (uint chunk = 0; chunk <= row / 2; chunk++) out[chunk] += (Number)numbers[row_at(row) + chunk] * product;
        }
    }
};

// Adds what the half warps of a team have, as a tree; entry t for each thread. `partial` is the team's own.
template <typename Number> __device__ __forceinline__ Number halves_add(const Number (&own)[UNKNOWNS / CHUNK], Number* partial, uint team, uint t) {
    uint warp = t / WARP, lane = t % CHUNK, half = t % WARP / CHUNK;
#pragma unroll
    for (uint chunk = 0; chunk < UNKNOWNS / CHUNK; chunk++) {
        Number both = own[chunk] + __shfl_xor_sync(ALL_LANES, own[chunk], CHUNK);
        if (chunk % 2 == half) partial[warp * UNKNOWNS + chunk * CHUNK + lane] = both;
    }
    team_wait(1 + team, TEAM);
    if (t >= UNKNOWNS) return 0;
    return (partial[t] + partial[2 * UNKNOWNS + t]) + (partial[UNKNOWNS + t] + partial[3 * UNKNOWNS + t]);
}

// Blocks of a row that are asked for at once.
#define NODE_TERMS 3

// Entry k of the residual of a node. The columns of the next blocks are on their way while some are worked on.
__device__ __forceinline__ double node_residual(const SchwarzLevel& level, const double* x, uint node, uint k) {
    double sum = 0, given = level.right_side[NODE * (size_t)node + k];
    uint at = __ldg(&level.rows[node]), end = __ldg(&level.rows[node + 1]), columns[NODE_TERMS];
    auto columns_load = [&](uint first) {
#pragma unroll
        for (uint turn = 0; turn < NODE_TERMS; turn++) columns[turn] = first < end ? __ldg(&level.columns[min(first + turn, end - 1)]) : 0;
    };
    columns_load(at);
    for (; at < end; at += NODE_TERMS) {
        double entries[NODE_TERMS][NODE];
        double2 others[NODE_TERMS][NODE / 2];
#pragma unroll
        for (uint turn = 0; turn < NODE_TERMS; turn++) {
            const double* block = level.blocks + NODE * NODE * (size_t)min(at + turn, end - 1) + k;
            const double2* other = (const double2*)(x + NODE * (size_t)columns[turn]);
#pragma unroll
            for (uint c = 0; c < NODE; c++) entries[turn][c] = __ldg(&block[NODE * c]);
#pragma unroll
            for (uint c = 0; c < NODE / 2; c++) others[turn][c] = other[c];
        }
        columns_load(at + NODE_TERMS);
#pragma unroll
        for (uint turn = 0; turn < NODE_TERMS; turn++) {
            if (at + turn >= end) break;
#pragma unroll
            for (uint c = 0; c < NODE / 2; c++) {
                sum += entries[turn][2 * c] * others[turn][c].x;
                sum += entries[turn][2 * c + 1] * others[turn][c].y;
            }
        }
    }
    return given - sum;
}

// Teams of a block.
#define TEAMS 4

// The passes of one application, with memory for each team.
struct SchwarzPasses {
    const Schwarz& p;
    ulong* barrier;
    TeamMemory& memory;
    uint team, t;

    __device__ __forceinline__ SchwarzPasses(const Schwarz& schwarz, ulong* of_grid, unsigned char* shared)
        : p(schwarz), barrier(of_grid), memory(((TeamMemory*)shared)[threadIdx.x / TEAM]), team(threadIdx.x / TEAM), t(threadIdx.x % TEAM) {}

    // All threads of the team are here.
    __device__ __forceinline__ void wait() const { team_wait(1 + team, TEAM); }

    // P^T of a vector: a warp for each group, a particle for each lane.
    __device__ __forceinline__ void groups(const real4* from) const {
        constexpr uint WARPS = TEAMS * TEAM / WARP;
        uint lane = t % WARP;
        for (uint group = blockIdx.x * WARPS + threadIdx.x / WARP; group < p.group_count; group += gridDim.x * WARPS) {
            uint place = __ldg(&p.group_starts[group]) + lane, end = __ldg(&p.group_starts[group + 1]);
            double sums[NODE] = {};
            if (place < end) {
                real4 entry = from[__ldg(&p.order[place])];
                double entries[3] = {entry.x, entry.y, entry.z};
                const float2* rows = (const float2*)(p.prolongation + 3 * NODE * (size_t)place);
#pragma unroll
                for (uint axis = 0; axis < 3; axis++) {
#pragma unroll
                    for (uint k = 0; k < NODE / 2; k++) {
                        float2 row = __ldg(&rows[NODE / 2 * axis + k]);
                        sums[2 * k] += (double)row.x * entries[axis];
                        sums[2 * k + 1] += (double)row.y * entries[axis];
                    }
                }
            }
#pragma unroll
            for (uint k = 0; k < NODE; k++) {
                double sum = sum_of_warp(sums[k]);
                if (lane == 0) p.levels[0].right_side[NODE * (size_t)group + k] = sum;
            }
        }
    }

    // x = w Z r for the unknowns of the runs that `residual` gives r of, x + w Z r with `adds`; `done` takes x.
    template <typename Residual, typename Done>
    __device__ __forceinline__ void smooth(const SchwarzLevel& level, bool adds, Residual residual, Done done) const {
        uint unknowns = NODE * level.count, runs = (unknowns + UNKNOWNS - 1) / UNKNOWNS;
        for (uint run = blockIdx.x * TEAMS + team; run < runs; run += gridDim.x * TEAMS) {
            uint start = run * UNKNOWNS, size = min((uint)UNKNOWNS, unknowns - start);
            FactorRows rows;
            rows.load(level.factors + (size_t)run * FACTOR, t);
            double scale = 0;
            if (t < size) scale = __ldg(&level.scale[start + t]);
            if (t < UNKNOWNS) memory.scaled[t] = t < size ? scale * residual(start + t) : 0;
            wait();
            double sums[UNKNOWNS / CHUNK];
            rows.times(memory.scaled, t, sums);
            double sum = halves_add(sums, (double*)memory.partial, team, t);
            double x = level.weight * (scale * sum) + (adds && t < size ? level.solution[0][start + t] : 0.0);
            // Nobody needs the vector any more.
            if (t < size) memory.scaled[t] = x;
            wait();
            done(start, size, x, memory.scaled);
            wait();
        }
    }

    // x += P of the unknowns of nodes of the level above, `x` of them from number `start` on.
    __device__ __forceinline__ void prolong(const SchwarzLevel& below, uint start, uint size, const double* x) const {
        uint first = start / NODE, last = first + size / NODE;
        uint begin = NODE * __ldg(&below.groups[first]), end = NODE * __ldg(&below.groups[last]);
#pragma unroll 2
        for (uint at = begin + t; at < end; at += TEAM) {
            const double* row = below.prolongation + NODE * (size_t)at;
            const double* own = x + NODE * (__ldg(&below.group_of[at / NODE]) - first);
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
        double *own = memory.scaled + half * HALF, *of_nodes = memory.partial[0] + half * HALF;
        for (uint first = 2 * (blockIdx.x * TEAMS + team); first < level.group_count; first += gridDim.x * 2 * TEAMS) {
            uint group = first + half, start = 0, size = 0;
            if (half < 2 && group < level.group_count) {
                start = level.groups[group];
                size = NODE * (level.groups[group + 1] - start);
            }
            if (u < size) own[u] = node_residual(level, level.solution[0], start + u / NODE, u % NODE);
            wait();
            // Of each node, then of all.
            double sum = 0;
            if (u < size) {
                const double* column = level.prolongation + NODE * NODE * (size_t)(start + u / NODE) + u % NODE;
                const double* of_node = own + u / NODE * NODE;
                for (uint k = 0; k < NODE; k++) sum += column[NODE * k] * of_node[k];
                of_nodes[u] = sum;
            }
            wait();
            if (u < NODE && size > 0) {
                sum = 0;
                for (uint k = u; k < size; k += NODE) sum += of_nodes[k];
                above.right_side[NODE * (size_t)group + u] = sum;
            }
            wait();
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
                    if (k > 1) prolong(p.levels[k - 2], start, size, own);
                });
            grid_barrier(barrier);
        }
    }

    // The last level: a team for each node, a half warp for each of its unknowns.
    __device__ __forceinline__ void bottom(const SchwarzLevel& level, const SchwarzLevel* below) const {
        uint size = NODE * level.count, lane = t % CHUNK, row = t / CHUNK;
        // Teams of different blocks first.
        for (uint node = team * gridDim.x + blockIdx.x; node < level.count; node += TEAMS * gridDim.x) {
            double sum = 0;
            if (row < NODE) {
                const double* entries = level.inverse + (size_t)size * (NODE * node + row);
#pragma unroll 8
                for (uint place = lane; place < size; place += CHUNK) sum += __ldg(&entries[place]) * level.right_side[place];
            }
            sum = sum_of_lanes(sum);
            if (row < NODE && lane == 0) memory.scaled[row] = level.solution[1][NODE * node + row] = sum;
            wait();
            if (below) prolong(*below, NODE * node, NODE, memory.scaled);
            wait();
        }
    }

    // All that comes before `schwarz_of`.
    __device__ __forceinline__ void apply(const real4* from) const {
        groups(from);
        grid_barrier(barrier);
        uint last = p.level_count - 1;
        down(last);
        bottom(p.levels[last], last > 0 ? &p.levels[last - 1] : nullptr);
        grid_barrier(barrier);
        up(last);
    }
};

// P^-1 of a vector for a particle, from what its block makes of it, `own`, and what `SchwarzPasses::apply` has left: unfiltered.
__device__ __forceinline__ vec3 schwarz_of(const Schwarz& p, const vec3& own, uint i) {
    const double2* coarse = (const double2*)(p.levels[0].solution[1] + NODE * (size_t)__ldg(&p.group_of[i]));
    const float2* rows = (const float2*)(p.prolongation + 3 * NODE * (size_t)__ldg(&p.places[i]));
    double sums[3] = {0, 0, 0};
#pragma unroll
    for (uint k = 0; k < NODE / 2; k++) {
        double2 unknowns = coarse[k];
#pragma unroll
        for (uint axis = 0; axis < 3; axis++) {
            float2 row = __ldg(&rows[NODE / 2 * axis + k]);
            sums[axis] = sums[axis] + (double)row.x * unknowns.x;
            sums[axis] = sums[axis] + (double)row.y * unknowns.y;
        }
    }
    return {own.x + (real)sums[0], own.y + (real)sums[1], own.z + (real)sums[2]};
}
