// NUMERICS section 5, `vector_dot`: sums of products in an order that is the same everywhere. A block of 512 particles has
// four parts. Each of the 16 lanes of a part adds up its particles, first those of two packets that follow each other, which
// are the two halves of a warp; lanes and parts are added as trees in double precision, blocks as trees of 32.
#define SUM_BLOCK 512
#define SUM_PART 128
#define SUM_LANES 16
#define SUMS_MAX 3
// Trees of 32 blocks that are worked on at once.
#define SUM_GROUPS 128

// A value of the lane `distance` away added to that of this one.
__device__ __forceinline__ double sum_across(double value, uint distance) { return value + __shfl_xor_sync(ALL_LANES, value, distance); }

// The same in every lane of 16, or of 32.
__device__ __forceinline__ double sum_of_lanes(double value) {
    for (uint distance = SUM_LANES / 2; distance > 0; distance /= 2) value = sum_across(value, distance);
    return value;
}

__device__ __forceinline__ double sum_of_warp(double value) {
    for (uint distance = WARP / 2; distance > 0; distance /= 2) value = sum_across(value, distance);
    return value;
}

// Memory for the sums of a block that takes STEP particles in a step, MEMBERS threads for each, and TURNS steps between two meetings
// of its threads. What is published as one number is the sum of a unit: a block of 512 particles, or what a step has of one.
template <uint STEP_SIZE, uint TURNS_MAX = STEP_SIZE < SUM_BLOCK ? 2 : 8, uint MEMBER_COUNT = 1> struct SumMemory {
    static constexpr uint STEP = STEP_SIZE;
    static constexpr uint TURNS = TURNS_MAX;
    static constexpr uint MEMBERS = MEMBER_COUNT;
    static constexpr uint THREADS = STEP * MEMBERS;
    static constexpr uint UNIT = STEP < SUM_BLOCK ? STEP : SUM_BLOCK;
    static constexpr uint UNITS = STEP / UNIT;
    // Units of a block of 512.
    static constexpr uint SHARE = SUM_BLOCK / UNIT;

    // What each particle has, or each two whose numbers differ by 16.
    real pairs[TURNS][2][STEP / WARP][MEMBERS > 1 ? WARP : SUM_LANES];
    double groups[2][SUM_GROUPS];
    double total[SUMS_MAX];

    // Puts what this thread, or the first one of this team, has of sum `which` in place; `__syncthreads` comes after it.
    __device__ __forceinline__ void put(uint turn, uint which, real product) {
        if constexpr (MEMBERS > 1) {
            uint place = threadIdx.x / MEMBERS;
            if (threadIdx.x % MEMBERS == 0) pairs[turn][which][place / WARP][place % WARP] = product;
            return;
        }
        real pair = product + __shfl_xor_sync(ALL_LANES, product, SUM_LANES);
        if (threadIdx.x % WARP < SUM_LANES) pairs[turn][which][threadIdx.x / WARP][threadIdx.x % WARP] = pair;
    }

    // The sum of a part, for each lane of 16.
    __device__ __forceinline__ double part(uint turn, uint which, uint part) const {
        real sum = 0;
        for (uint k = 0; k < SUM_PART / WARP; k++) {
            const real* pair = pairs[turn][which][part * (SUM_PART / WARP) + k] + threadIdx.x % SUM_LANES;
            if constexpr (MEMBERS > 1) {
                sum += pair[0] + pair[SUM_LANES];
            } else {
                sum += pair[0];
            }
        }
        return sum_of_lanes((double)sum);
    }

    // The sum of a unit, worked out by a whole warp.
    __device__ __forceinline__ double unit(uint turn, uint which, uint unit) const {
        uint half = threadIdx.x % WARP / SUM_LANES;
        if constexpr (UNIT == SUM_BLOCK) {
            uint first = unit * (SUM_BLOCK / SUM_PART) + 2 * half;
            return sum_across(part(turn, which, first) + part(turn, which, first + 1), SUM_LANES);
        } else if constexpr (UNIT == 2 * SUM_PART) {
            return sum_across(part(turn, which, half), SUM_LANES);
        } else {
            return part(turn, which, 0);
        }
    }

    // The sums of `count` kinds in the first `turns` turns go where they belong, a number for each unit, those of a turn
    // `stride` steps after the one before it.
    __device__ __forceinline__ void finish(uint turns, uint count, double* first, double* second, uint step, int stride) const {
        for (uint task = threadIdx.x / WARP; task < turns * count * UNITS; task += THREADS / WARP) {
            uint which = task % count, place = task / count % UNITS, turn = task / count / UNITS;
            double sum = unit(turn, which, place);
            if (threadIdx.x % WARP == 0) (which == 0 ? first : second)[(step + (int)turn * stride) * UNITS + place] = sum;
        }
    }

    // Adds the sums of all blocks, of one or two kinds; every thread gets them. Unrolled without need, these loops are most of the code of a solver,
    // for which a compiler takes many seconds.
    __device__ __forceinline__ void add_blocks(uint count, const double* first, const double* second, uint units, double& a, double& b) {
        uint warp = threadIdx.x / WARP, lane = threadIdx.x % WARP;
        uint blocks = (units + SHARE - 1) / SHARE;
        double sum = 0;
#pragma unroll 1
        for (uint start = 0; start < blocks; start += SUM_GROUPS * WARP) {
            uint used = min((blocks - start + WARP - 1) / WARP, (uint)SUM_GROUPS);
            __syncthreads();
#pragma unroll (MEMBERS > 1 ? 1 : 2)
            for (uint task = warp; task < used * count; task += THREADS / WARP) {
                uint which = task % count, group = task / count;
                double value = sum_of_warp(block_of(which == 0 ? first : second, start + group * WARP + lane, units));
                if (lane == 0) groups[which][group] = value;
            }
            __syncthreads();
            if (warp < count) {
#pragma unroll 1
                for (uint group = 0; group < used; group += WARP) {
                    sum += sum_of_warp(group + lane < used ? groups[warp][group + lane] : 0);
                }
            }
        }
        if (warp < count && lane == 0) total[warp] = sum;
        __syncthreads();
        a = total[0];
        b = total[1];
    }

    // The sum of a block of 512 from those of its units.
    static __device__ __forceinline__ double block_of(const double* sums, uint block, uint units) {
        double own[SHARE];
        for (uint k = 0; k < SHARE; k++) own[k] = block * SHARE + k < units ? sums[block * SHARE + k] : 0;
        return units_add(own);
    }

    static __device__ __forceinline__ double units_add(const double (&own)[SHARE]) {
        if constexpr (SHARE == 4) {
            return (own[0] + own[1]) + (own[2] + own[3]);
        } else if constexpr (SHARE == 2) {
            return own[0] + own[1];
        } else {
            return own[0];
        }
    }
};
