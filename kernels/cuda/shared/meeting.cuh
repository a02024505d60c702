// Meetings of all blocks of a kernel whose blocks are all resident, at which they agree on what any of them has found: the
// counter that they wait for has fields for what they say, so that who sees that all are there knows it. Two counters are
// used in turn, as who is early at the next meeting would else change what others are still to read; both are 0 at the
// start of the kernel.

// What blocks say.
#define VOTE_STALE 1u
#define VOTE_STOP 2u

// Fields of a counter: blocks that came, those that found the list stale, and those that found a number that is not finite.
// A launch has at most a thousand substeps, of ten meetings each at most without sweeps, so that none but the last runs over.
#define MEETING_FIELD 24

// In shared memory.
struct Meeting {
    // What this block says, and what all have said.
    uint votes;
    uint agreed;
    uint number;
    // What both counters were at their last meetings.
    ulong before[2];

    // By one thread.
    __device__ __forceinline__ void start() {
        votes = agreed = number = 0;
        before[0] = before[1] = 0;
    }

    // By threads that have something to say.
    __device__ __forceinline__ void vote(uint what) { atomicOr(&votes, what); }

    __device__ __forceinline__ static uint field(ulong counter, uint which) {
        return (uint)(counter >> which * MEETING_FIELD) & ((1u << MEETING_FIELD) - 1);
    }

    // Gives what any block has said since the last meeting. All threads of all blocks take part.
    __device__ __forceinline__ uint meet(ulong* counters) {
        __syncthreads();
        if (threadIdx.x == 0) {
            ulong* counter = &counters[number & 1];
            ulong& last = before[number & 1];
            number++;
            ulong mine = 1;
            if (votes & VOTE_STALE) mine += (ulong)1 << MEETING_FIELD;
            if (votes & VOTE_STOP) mine += (ulong)1 << 2 * MEETING_FIELD;
            votes = 0;
            add_release(counter, mine);
            // Each counter has had every other meeting.
            uint all = gridDim.x * ((number + 1) / 2);
            ulong now;
            do now = load_acquire(counter);
            while (field(now, 0) < all);
            agreed = (field(now, 1) != field(last, 1) ? VOTE_STALE : 0) | (field(now, 2) != 0 ? VOTE_STOP : 0);
            last = now;
        }
        __syncthreads();
        return agreed;
    }
};
