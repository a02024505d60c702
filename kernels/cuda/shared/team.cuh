// Rows of a matrix by teams of threads: where there are far fewer particles than a device has threads, what one thread waits for in a
// long row is what takes the time.

// Threads of a team.
#define ROW_TEAM 4
// Terms that each of them works out before they are added.
#define TEAM_TERMS 3

// Adds the terms from `first` to `end` of a row to its sum, in their order. `work(k, term)` works out the k-th one, which is zero before, and says
// whether it exists; behind one that does not there are none. With several MEMBERS of a team, these work out different ones and all add all of them: the
// sum is that of one thread. All lanes of a warp call it together.
template <uint MEMBERS, typename Work> __device__ __forceinline__ void terms_add(vec3& sum, uint first, uint end, Work work) {
    if constexpr (MEMBERS == 1) {
#pragma unroll 4
        for (uint k = first; k < end; k++) {
            vec3 term = {0, 0, 0};
            if (!work(k, term)) break;
            sum = sum + term;
        }
    } else {
        uint lane = threadIdx.x % MEMBERS, leader = threadIdx.x % WARP - lane;
        for (uint start = first + lane;; start += MEMBERS * TEAM_TERMS) {
            vec3 terms[TEAM_TERMS] = {};
            bool exists[TEAM_TERMS];
#pragma unroll
            for (uint turn = 0; turn < TEAM_TERMS; turn++) {
                uint k = start + turn * MEMBERS;
                exists[turn] = k < end && work(k, terms[turn]);
            }
#pragma unroll
            for (uint turn = 0; turn < TEAM_TERMS; turn++) {
                uint all = __ballot_sync(ALL_LANES, exists[turn]);
                if (all == 0) return;
#pragma unroll
                for (uint member = 0; member < MEMBERS; member++) {
                    const vec3& term = terms[turn];
                    vec3 shown = {
                        __shfl_sync(ALL_LANES, term.x, leader + member),
                        __shfl_sync(ALL_LANES, term.y, leader + member),
                        __shfl_sync(ALL_LANES, term.z, leader + member),
                    };
                    if (all >> (leader + member) & 1) sum = sum + shown;
                }
            }
        }
    }
}
