// A particle for each thread, with everything that its row needs in registers for a whole solve. Blocks tell each other vectors and
// sums in entries of 16 bytes that hold a stamp, which are read again until they have the stamp that is waited for. So there is
// no barrier between blocks. None writes a vector over one that is still wanted: it goes on from an iteration with the sums of
// all blocks, and a block tells its last sum after it has read all vectors. Sums have two places in turn, as a block can be an
// iteration ahead of another that it does not read from.

// Springs of a particle at most.
#define RESIDENT_SPRINGS 24
#define RESIDENT_THREADS 256
// Entries that a thread asks for before it waits.
#define RESIDENT_LOADS 4
// Blocks of 512 particles at most.
#define RESIDENT_BLOCKS 96

#ifndef CLOTH_F64
template <uint THREADS> struct Resident {
    typedef SumMemory<THREADS> Sums;

    // Vectors of the particles of the block, `reach` before them and after them.
    real4* window;
    uint i;
    bool exists;
    bool is_free;
    bool touches;
    vec3 base_on, base_off, inverse_on, inverse_off;
    SpringBlock springs[RESIDENT_SPRINGS];
    // Places of neighbours in the window, two in each.
    uint places[RESIDENT_SPRINGS / 2];

    __device__ __forceinline__ Resident(const Solver& s, const Linear& l, real4* memory) : window(memory) {
        i = blockIdx.x * THREADS + threadIdx.x;
        exists = i < s.count;
        vec3 zero = {0, 0, 0};
        base_on = base_off = inverse_on = inverse_off = zero;
        is_free = touches = false;
        vec3 origin = zero;
        SpringRow row = {0, 0, 0};
        if (exists) {
            base_on = xyz(l.base[0][i]);
            if (l.is_full) base_off = xyz(l.base[1][i]);
            inverse_on = xyz(l.inverse[0][i]);
            if (l.has_blocks) inverse_off = xyz(l.inverse[1][i]);
            real4 place = l.origin[i];
            origin = xyz(place);
            is_free = s.position[s.present][i].w > 0;
            touches = l.has_constraints && l.touch_counts[i] > 0;
            row = spring_row(s, i);
        }
        uint centre = l.reach + threadIdx.x;
#pragma unroll
        for (uint k = 0; k < RESIDENT_SPRINGS; k++) {
            uint place = centre;
            springs[k] = {zero, 0};
            if (k < row.count) {
                uint at = row.first + (k << row.shift);
                uint2 link = l.links[at];
                size_t where = factor_place(s, l, link.y, i, i + link.x);
                springs[k] = spring_block(l, at, where, xyz(l.origin[i + link.x]) - origin);
                place = centre + link.x;
            }
            places[k / 2] = k % 2 == 0 ? place : places[k / 2] | place << 16;
        }
    }

    __device__ __forceinline__ vec3 load(const real4* vector) const {
        if (exists) return xyz(vector[i]);
        return {0, 0, 0};
    }

    __device__ __forceinline__ void store(real4* vector, const vec3& value) const {
        if (exists) vector[i] = with_w(value, 0);
    }

    __device__ __forceinline__ vec3 filtered(const Linear& l, const vec3& value) const {
        if (!is_free) return {0, 0, 0};
        if (touches) return symmetric_apply(xyz(l.filter[0][i]), xyz(l.filter[1][i]), value);
        return value;
    }

    __device__ __forceinline__ vec3 preconditioned(const Linear& l, const vec3& value) const {
        if (l.has_blocks) return symmetric_apply(inverse_on, inverse_off, value);
        return {inverse_on.x * value.x, inverse_on.y * value.y, inverse_on.z * value.z};
    }

    // Row of A times the vectors in the window.
    __device__ __forceinline__ vec3 row(const Linear& l, const vec3& own) const {
        vec3 sum = base_apply(base_on, base_off, l.is_full, own);
#pragma unroll
        for (uint k = 0; k < RESIDENT_SPRINGS; k++) {
            uint place = k % 2 == 0 ? places[k / 2] & 0xffff : places[k / 2] >> 16;
            spring_add(sum, springs[k], own - xyz(window[place]));
        }
        return sum;
    }

    // Tells the vector of this particle.
    __device__ __forceinline__ void publish(const Linear& l, uint stamp, const vec3& value) const {
        window[l.reach + threadIdx.x] = with_w(value, 0);
        if (!exists) return;
        ulong low = (ulong)__float_as_uint(value.y) << 32 | __float_as_uint(value.x);
        pair_store(&l.exchange[stamp % 2][i], low, (ulong)stamp << 32 | __float_as_uint(value.z));
    }

    // Waits for the vectors of other blocks.
    __device__ __forceinline__ void collect(const Solver& s, const Linear& l, uint stamp) const {
        uint first = i - threadIdx.x - l.reach;
        const real4* from = l.exchange[stamp % 2];
        for (uint start = threadIdx.x; start < 2 * l.reach; start += RESIDENT_LOADS * THREADS) {
            ulong low[RESIDENT_LOADS], high[RESIDENT_LOADS];
            bool is_here;
            do {
                is_here = true;
#pragma unroll
                for (uint k = 0; k < RESIDENT_LOADS; k++) {
                    uint place = start + k * THREADS;
                    uint j = first + place + (place < l.reach ? 0 : THREADS);
                    high[k] = (ulong)stamp << 32;
                    if (place < 2 * l.reach && j < s.count) pair_load(&from[j], low[k], high[k]);
                }
#pragma unroll
                for (uint k = 0; k < RESIDENT_LOADS; k++) is_here = is_here && (uint)(high[k] >> 32) == stamp;
            } while (!is_here);
#pragma unroll
            for (uint k = 0; k < RESIDENT_LOADS; k++) {
                uint place = start + k * THREADS;
                if (place >= 2 * l.reach) continue;
                window[place + (place < l.reach ? 0 : THREADS)] = {
                    __uint_as_float((uint)low[k]), __uint_as_float((uint)(low[k] >> 32)), __uint_as_float((uint)high[k]), 0};
            }
        }
    }

    // The first warps work out the sums of this block and tell them: `count` of those put in place, as sums from `first` on.
    __device__ __forceinline__ void sums_publish(const Linear& l, const Sums& memory, uint turn, uint first, uint count, uint stamp) const {
        uint warp = threadIdx.x / WARP;
        if (warp >= count) return;
        double sum = memory.unit(turn, warp, 0);
        Sum* to = l.sums[stamp % 2] + (first + warp) * gridDim.x + blockIdx.x;
        if (threadIdx.x % WARP == 0) pair_store(to, (ulong)__double_as_longlong(sum), stamp);
    }

    // Waits for the sums of all blocks from `first` to `end` and adds them; every thread gets them.
    __device__ __forceinline__ void sums_collect(const Linear& l, Sums& memory, uint first, uint end, uint stamp, double (&sums)[SUMS_MAX]) const {
        constexpr uint SHARE = Sums::SHARE, GROUPS = RESIDENT_BLOCKS / WARP;
        uint which = first + threadIdx.x / WARP, lane = threadIdx.x % WARP;
        if (which < end) {
            const Sum* from = l.sums[stamp % 2] + which * gridDim.x;
            ulong values[GROUPS][SHARE], stamps[GROUPS][SHARE];
            bool is_here;
            do {
                is_here = true;
#pragma unroll
                for (uint group = 0; group < GROUPS; group++)
#pragma unroll
                    for (uint k = 0; k < SHARE; k++) {
                        uint unit = (group * WARP + lane) * SHARE + k;
                        values[group][k] = 0;
                        stamps[group][k] = stamp;
                        if (unit < gridDim.x) pair_load(&from[unit], values[group][k], stamps[group][k]);
                    }
#pragma unroll
                for (uint group = 0; group < GROUPS; group++)
#pragma unroll
                    for (uint k = 0; k < SHARE; k++) is_here = is_here && stamps[group][k] == stamp;
            } while (!is_here);
            double groups[GROUPS];
#pragma unroll
            for (uint group = 0; group < GROUPS; group++) {
                double own[SHARE];
#pragma unroll
                for (uint k = 0; k < SHARE; k++) own[k] = __longlong_as_double((long long)values[group][k]);
                groups[group] = sum_of_warp(Sums::units_add(own));
            }
            // A tree of 32 in which all but these are zero.
            double total = (groups[0] + groups[2]) + groups[1];
            if (lane == 0) memory.total[which] = total;
        }
        __syncthreads();
#pragma unroll
        for (uint k = 0; k < SUMS_MAX; k++) {
            if (k >= first && k < end) sums[k] = memory.total[k];
        }
    }
};
#endif
