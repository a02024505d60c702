// What kernels that do a whole frame of explicit substeps have in common: what they keep in shared memory, and how it gets there.

// Colliders that are kept.
#define COLLIDERS_NEAR 4
// Substeps whose numbers are kept, a power of two.
#define SUBSTEPS_NEAR 4

// Starts to copy an entry.
__device__ __forceinline__ void copy_start(real4* to, const real4* from) {
    for (uint part = 0; part < sizeof(real4); part += 16) copy_start_16((char*)to + part, (const char*)from + part);
}

// Copies words by so many threads, of which this one is number `thread`.
__device__ __forceinline__ void words_copy(void* to, const void* from, uint bytes, uint thread, uint threads) {
    for (uint at = thread; at < bytes / 4; at += threads) ((uint*)to)[at] = ((const uint*)from)[at];
}

// The same while work goes on.
__device__ __forceinline__ void words_copy_start(void* to, const void* from, uint bytes, uint thread, uint threads) {
    for (uint at = thread; at < bytes / 8; at += threads) copy_start_8((char*)to + 8 * at, (const char*)from + 8 * at);
}

// Stores a particle; books a number that is not finite, and says whether there is none.
__device__ __forceinline__ bool particle_store(const Solver& s, real4* x, real4* v, const SubstepData& substep, uint i, const Moved& moved, real inverse_mass, real mass) {
    x[i] = with_w(moved.position, inverse_mass);
    v[i] = with_w(moved.velocity, mass);
    bool finite = is_finite(moved.position) && is_finite(moved.velocity);
    if (!finite) atomicMin(&s.status->non_finite_step, substep.step);
    return finite;
}

// The substeps that come next, and the colliders at their ends where these are few. In shared memory; threads 0 to
// `threads` fill it.
struct NearFrame {
    SubstepData substeps[SUBSTEPS_NEAR];
    Collider colliders[2][COLLIDERS_NEAR];

    __device__ __forceinline__ static bool has_colliders(const Solver& s) { return s.collider_count <= COLLIDERS_NEAR; }

    // The first of `count` substeps, and the one after it.
    __device__ __forceinline__ void start(const Solver& s, uint count, uint thread, uint threads) {
        words_copy(substeps, s.substeps, min(count, 2u) * sizeof(SubstepData), thread, threads);
        if (has_colliders(s)) words_copy(colliders[0], s.colliders + s.substeps[0].collider_first, s.collider_count * sizeof(Collider), thread, threads);
    }

    // What comes after substep `number`; if `LATER`, only `copies_wait` ends it.
    template <bool LATER> __device__ __forceinline__ void follow(const Solver& s, uint number, uint count, uint thread, uint threads) {
        auto copy = [&](void* to, const void* from, uint bytes) {
            if (LATER) {
                words_copy_start(to, from, bytes, thread, threads);
            } else {
                words_copy(to, from, bytes, thread, threads);
            }
        };
        if (number + 2 < count) copy(&substeps[(number + 2) % SUBSTEPS_NEAR], &s.substeps[number + 2], sizeof(SubstepData));
        if (has_colliders(s) && number + 1 < count) {
            uint next = of(number + 1).collider_first;
            copy(colliders[(number + 1) & 1], s.colliders + next, s.collider_count * sizeof(Collider));
        }
    }

    __device__ __forceinline__ const SubstepData& of(uint number) const { return substeps[number % SUBSTEPS_NEAR]; }

    __device__ __forceinline__ const Collider* colliders_of(const Solver& s, uint number) const {
        return has_colliders(s) ? colliders[number & 1] : s.colliders + of(number).collider_first;
    }
};
