// The composite stage for a general mesh whose entries of springs are packed, as `explicit_substep.cu` does it, where nothing but
// fields, springs and colliders acts: a whole frame in one launch. What takes time is waiting for memory. So there is one block for
// each multiprocessor, as large as the registers allow, which finds most neighbours in its first level of the caches; and a thread
// asks for what it needs to know of its next particles while it works on one.

// Leaves each thread 96 registers.
#define THREADS 640
// Entries of a row that are loaded ahead, and springs whose second ends are loaded together.
#define AHEAD 12
#define TOGETHER 4
// Kinds of springs that are kept in shared memory.
#define KINDS_NEAR 64

// A row as its header has it, which takes fewer registers.
struct Row {
    uint2 header;

    __device__ __forceinline__ static Row of(const Solver& s, uint number) { return {__ldg(&s.spring_headers[number])}; }
    __device__ __forceinline__ uint count() const { return header.y & 0xffffffu; }
    // Any word beyond its end.
    __device__ __forceinline__ uint entry(const Solver& s, uint k) const {
        return k < count() ? __ldg(&s.spring_packed[header.x + (k << (header.y >> 24))]) : 0;
    }
};

__device__ __forceinline__ uint entry_neighbour(uint entry, uint i) { return i + (uint)(int)(short)(entry & 0xffffu); }

__device__ __forceinline__ SpringKind entry_kind(const real4* kinds, uint entry) {
    real4 numbers = kinds[entry >> 16];
    return {numbers.x, numbers.y, numbers.z, nullptr};
}

// Adds the springs of some entries, `ALL` of them or the first few. Lowers `least` to the square of the shortest.
template <bool PLAIN, bool ALL>
__device__ __forceinline__ void springs_add(
    const Motion& motion, const real4* kinds, const uint (&entries)[TOGETHER], uint count, uint i, const vec3& xi, const vec3& vi, vec3& force, real& least
) {
    real4 x[TOGETHER], v[TOGETHER];
#pragma unroll
    for (uint n = 0; n < TOGETHER; n++) {
        uint j = entry_neighbour(entries[n], i);
        x[n] = motion.x[j];
        v[n] = motion.v[j];
    }
#pragma unroll
    for (uint n = 0; n < TOGETHER; n++) {
        Spring spring = spring_at<PLAIN>(entry_kind(kinds, entries[n]), xi, vi, xyz(x[n]), xyz(v[n]));
        vec3 sum = force + spring.force();
        if (ALL || n < count) {
            force = sum;
            least = fmin(spring.length_squared, least);
        }
    }
}

extern "C" __global__ void __launch_bounds__(THREADS, 1) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    __shared__ NearFrame near_frame;
    __shared__ real4 near_kinds[KINDS_NEAR];
    Motion motion = present_motion(s);
    real4* next_x = s.position[1 - s.present];
    real4* next_v = s.velocity[1 - s.present];
    uint first = blockIdx.x * s.chunk + threadIdx.x, end = min((blockIdx.x + 1) * s.chunk, s.count);
    // Nothing changes any more once a number is not finite, but a frame goes to its end.
    if (*(volatile ulong*)&s.status->non_finite_step < s.substeps[0].step) {
        for (uint i = first; i < end && (substeps & 1); i += THREADS) {
            next_x[i] = motion.x[i];
            next_v[i] = motion.v[i];
        }
        publish(s, s.epoch + substeps);
        return;
    }
    const real4* kinds = s.spring_kinds;
    if (s.kind_count <= KINDS_NEAR) {
        words_copy(near_kinds, kinds, s.kind_count * sizeof(real4), threadIdx.x, THREADS);
        kinds = near_kinds;
    }
    near_frame.start(s, substeps, threadIdx.x, THREADS);
    // The particles of a thread in turn, in one substep after the other.
    auto after = [&](uint i) { return i + THREADS < end ? i + THREADS : first; };
    // Row and first entries of the particle that is next, row of the one after it, number of the row of the third.
    Row row = {{0, 0}}, row_after = {{0, 0}};
    uint entries[AHEAD], number_after = 0;
    if (first < end) {
        row = Row::of(s, s.spring_row[first]);
#pragma unroll
        for (uint k = 0; k < AHEAD; k++) entries[k] = row.entry(s, k);
        row_after = Row::of(s, s.spring_row[after(first)]);
        number_after = s.spring_row[after(after(first))];
    }
    for (uint number = 0; number < substeps; number++) {
        if (number > 0) {
            wait_for_dependencies(s, s.epoch + number);
        } else {
            copies_wait();
            __syncthreads();
        }
        const SubstepData& substep = near_frame.of(number);
        const Collider* colliders = near_frame.colliders_of(s, number);
        near_frame.follow<false>(s, number, substeps, threadIdx.x, THREADS);
        real4 next_own = {0, 0, 0, 0}, next_rate = {0, 0, 0, 0};
        if (first < end) {
            next_own = motion.x[first];
            next_rate = motion.v[first];
        }
#pragma unroll 1
        for (uint i = first; i < end; i += THREADS) {
            real4 own = next_own, rate = next_rate;
            if (i + THREADS < end) {
                next_own = motion.x[i + THREADS];
                next_rate = motion.v[i + THREADS];
            }
            real offset = s.offsets[i];
            vec3 xi = xyz(own), vi = xyz(rate);
            vec3 before = field_force(s, rate.w, vi);
            before = procedural_force(substep, i, xi, vi, rate.w, before);
            vec3 force = before;
            real least = REAL_MAX;
            Row row_third = {{0, 0}};
            uint number_third = 0;
#pragma unroll
            for (uint k = 0; k < AHEAD; k += TOGETHER) {
                uint now[TOGETHER];
#pragma unroll
                for (uint n = 0; n < TOGETHER; n++) {
                    now[n] = entries[k + n];
                    entries[k + n] = row_after.entry(s, k + n);
                }
                if (k + TOGETHER == AHEAD) {
                    row_third = Row::of(s, number_after);
                    number_third = __ldg(&s.spring_row[after(after(after(i)))]);
                }
                if (k + TOGETHER <= row.count()) {
                    springs_add<true, true>(motion, kinds, now, TOGETHER, i, xi, vi, force, least);
                } else if (k < row.count()) {
                    springs_add<true, false>(motion, kinds, now, row.count() - k, i, xi, vi, force, least);
                }
            }
#pragma unroll 1
            for (uint k = AHEAD; k < row.count(); k += TOGETHER) {
                uint now[TOGETHER];
#pragma unroll
                for (uint n = 0; n < TOGETHER; n++) now[n] = row.entry(s, k + n);
                springs_add<true, false>(motion, kinds, now, row.count() - k, i, xi, vi, force, least);
            }
#if !defined(CLOTH_FAST) && !defined(CLOTH_F64)
            // Once more with care.
            if (least < ROOT_PLAIN_MIN) {
                force = before;
#pragma unroll 1
                for (uint k = 0; k < row.count(); k++) {
                    uint entry = row.entry(s, k), j = entry_neighbour(entry, i);
                    force = force + spring_at(entry_kind(kinds, entry), xi, vi, xyz(motion.x[j]), xyz(motion.v[j])).force();
                }
            }
#endif
            row = row_after;
            row_after = row_third;
            number_after = number_third;
            Moved moved = integrate(substep.length, own.w, force, xi, vi);
            if (own.w > 0) collide_all<false>(s, colliders, i, offset, own.w, xi, substep.length, moved);
            particle_store(s, next_x, next_v, substep, i, moved, own.w, rate.w);
        }
        publish(s, s.epoch + number + 1);
        real4* last_x = next_x;
        real4* last_v = next_v;
        next_x = (real4*)motion.x;
        next_v = (real4*)motion.v;
        motion = {last_x, last_v};
    }
}
