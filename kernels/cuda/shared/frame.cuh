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

// Starts to copy the particles of a rectangle of the patch, row by row, from a row and column that may be outside; by all threads of the block.
// Of what is not there the positions become `nowhere`.
template <uint ENTRIES, uint STRIDE, uint THREADS>
__device__ __forceinline__ void rectangle_start(const Solver& s, const Motion& motion, uint first_row, uint first_column, real nowhere, real4* x, real4* v) {
    // Unrolled, so that all are on their way together.
#pragma unroll
    for (uint first = 0; first < ENTRIES; first += THREADS) {
        uint entry = first + threadIdx.x;
        if (entry >= ENTRIES) break;
        uint row = first_row + entry / STRIDE, column = first_column + entry % STRIDE;
        if (row < s.rows && column < s.columns) {
            copy_start(x + entry, motion.x + row * s.columns + column);
            copy_start(v + entry, motion.v + row * s.columns + column);
        } else {
            x[entry] = {nowhere, nowhere, nowhere, 0};
            v[entry] = {0, 0, 0, 0};
        }
    }
}

// Contact with more colliders than are kept.
__device__ __noinline__ Moved collide_many(const Solver& s, const Collider* colliders, uint i, real offset, real inverse_mass, vec3 start, real length, Moved moved) {
    collide_all<false>(s, colliders, i, offset, inverse_mass, start, length, moved);
    return moved;
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

    // The first of `count` substeps, and the one after it; only `copies_wait` ends it.
    __device__ __forceinline__ void start(const Solver& s, uint count, uint thread, uint threads) {
        uint first = s.substeps[0].collider_first;
        words_copy_start(substeps, s.substeps, min(count, 2u) * sizeof(SubstepData), thread, threads);
        if (has_colliders(s)) words_copy_start(colliders[0], s.colliders + first, s.collider_count * sizeof(Collider), thread, threads);
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

    // Contact of a free particle with all colliders at the end of substep `number`.
    __device__ __forceinline__ void collide(const Solver& s, uint number, uint i, real offset, real inverse_mass, const vec3& start, Moved& moved) const {
        if (has_colliders(s)) {
            collide_all<false>(s, colliders[number & 1], i, offset, inverse_mass, start, of(number).length, moved);
        } else {
            moved = collide_many(s, s.colliders + of(number).collider_first, i, offset, inverse_mass, start, of(number).length, moved);
        }
    }
};
