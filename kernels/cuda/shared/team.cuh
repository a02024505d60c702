// Rows of a matrix by teams of threads: where there are far fewer particles than a device has threads, what one thread waits for in a
// long row is what takes the time.

// Threads of a team.
#define ROW_TEAM 4

// Terms that a thread asks for before it waits for what they read.
#if defined(CLOTH_TEAMS) || defined(CLOTH_SCHWARZ)
#define ROW_TERMS 3
#else
#define ROW_TERMS 2
#endif

// Adds the terms from `first` to `end` of a row to its sum, in their order. `work(k, term)` works out the k-th one and says whether it exists; behind one
// that does not there are none. With several MEMBERS of a team, these work out different ones and all add all of them: the sum is that of one thread. All
// lanes of a warp call it together then.
template <uint MEMBERS, typename Work> __device__ __forceinline__ void terms_add(vec3& sum, uint first, uint end, Work work) {
    uint lane = threadIdx.x % MEMBERS, leader = threadIdx.x % WARP - lane;
    for (uint start = first + lane; MEMBERS > 1 || start < end; start += MEMBERS * ROW_TERMS) {
        vec3 terms[ROW_TERMS] = {};
        bool exists[ROW_TERMS] = {};
        if (start < end) {
            // What is beyond the end is read again and left out: without a branch, nothing waits for anything else.
#pragma unroll
            for (uint turn = 0; turn < ROW_TERMS; turn++) {
                uint k = start + turn * MEMBERS;
                exists[turn] = work(min(k, end - 1), terms[turn]) && k < end;
            }
        }
#pragma unroll
        for (uint turn = 0; turn < ROW_TERMS; turn++) {
            if constexpr (MEMBERS == 1) {
                if (!exists[turn]) return;
                sum = sum + terms[turn];
            } else {
                uint all = __ballot_sync(ALL_LANES, exists[turn]);
                if (all == 0) return;
                const vec3& own = terms[turn];
#pragma unroll
                for (uint member = 0; member < MEMBERS; member++) {
                    uint from = leader + member;
                    vec3 term = {__shfl_sync(ALL_LANES, own.x, from), __shfl_sync(ALL_LANES, own.y, from), __shfl_sync(ALL_LANES, own.z, from)};
                    if (all >> from & 1) sum = sum + term;
                }
            }
        }
    }
}
