// The composite stage where more than one pass makes a substep: triangles of fabric, contact by impulses, or strain limiting. A whole
// frame in one launch, for any model.
//
// All blocks are resident. What follows a part reads what other blocks have written, so that all meet after each: the three parts of the forces of triangles, the
// pass that sums them, the search for partners, the impulses, each sweep. A part reads one motion and writes the other. With impulses a warp
// does the pass for a group, whose positions it puts where others look for partners; without, a block does it for its run of particles.
// Colliders act at the end of the last part, when the thread that stores a particle has it at hand.

#ifdef CLOTH_PENALTY
#define PENALTY true
#else
#define PENALTY false
#endif
#ifdef CLOTH_IMPULSES
#define IMPULSES true
#else
#define IMPULSES false
#endif
#ifdef CLOTH_LIMITS
#define LIMITS true
#else
#define LIMITS false
#endif
#ifdef CLOTH_EXTRAS
#define EXTRAS true
#else
#define EXTRAS false
#endif

#define THREADS 512

// Colliders act in the pass where nothing comes after it.
#define ENDS_IN_PASS (!IMPULSES && !LIMITS)

// Few blocks for each multiprocessor, and registers in plenty: for models that do not fill the device, and for the folds of a triangle.
#ifdef CLOTH_MANY_REGISTERS
#define BLOCKS_PER_SM 1
#else
#define BLOCKS_PER_SM 2
#endif

// What the parts of one substep have in common.
struct Part {
    const SubstepData& substep;
    const Collider* colliders;
    Motion motion;
    real4* next_x;
    real4* next_v;
    // Whether a number is not finite: nothing changes any more.
    bool stopped;

    // The motion that was written is read, and the other way round.
    __device__ __forceinline__ void swap() {
        real4* x = next_x;
        real4* v = next_v;
        next_x = (real4*)motion.x;
        next_v = (real4*)motion.v;
        motion = {x, v};
    }

    // Stores a particle at the end of its substep.
    __device__ __forceinline__ void store_last(const Solver& s, uint i, Moved moved, real inverse_mass, real mass) const {
        if (inverse_mass > 0 && !stopped) {
            // Without a start a particle has stayed where it is.
            vec3 start = s.start_position != nullptr ? xyz(s.start_position[i]) : moved.position;
            collide_all<EXTRAS>(s, colliders, i, s.offsets[i], inverse_mass, start, substep.length, moved);
        }
        next_x[i] = with_w(moved.position, inverse_mass);
        next_v[i] = with_w(moved.velocity, mass);
    }
};

// Forces and integration of one particle. Gives where it gets to.
__device__ __forceinline__ vec3 particle_pass(const Solver& s, const Part& part, uint i, uint& contacts, bool& finite) {
    const Motion& motion = part.motion;
    real4 own = motion.x[i], rate = motion.v[i];
    if (s.start_position != nullptr) ((real4*)s.start_position)[i] = own;
    Moved moved = {xyz(own), xyz(rate)};
    if (!part.stopped) {
        uint found = PENALTY ? s.candidate_counts[i] : 0;
        const Collider* colliders = ENDS_IN_PASS ? part.colliders : nullptr;
        moved = particle_advance<PENALTY, EXTRAS, false>(s, nullptr, nullptr, motion, part.substep, colliders, motion.x, motion.v, i, i, own, rate, nullptr, found, contacts);
    }
    finite &= particle_store(s, part.next_x, part.next_v, part.substep, i, moved, own.w, rate.w);
    return moved.position;
}

// The springs of the one region of a block, where each block has one at most: they stay in shared memory for the whole frame. Those that come
// first are followed by the rows.
struct NearSprings {
    const uint2* springs;
    const uint* rows;

    // At `memory`, if they fit, by all threads of the block.
    __device__ __forceinline__ static NearSprings load(const Solver& s, uint2* memory) {
        if (s.limit_springs_near == 0 || blockIdx.x >= s.limit_region_count) return {s.limit_springs, s.limit_rows};
        const uint* rows = s.limit_rows + blockIdx.x * (s.limit_colours + 1);
        uint first = rows[0], count = rows[s.limit_colours] - first;
        uint* own = (uint*)(memory + s.limit_springs_near);
        for (uint k = threadIdx.x; k < count; k += THREADS) memory[k] = s.limit_springs[first + k];
        for (uint k = threadIdx.x; k <= s.limit_colours; k += THREADS) own[k] = rows[k] - first;
        __syncthreads();
        return {memory, own - blockIdx.x * (s.limit_colours + 1)};
    }
};

// `strain_limit`, one sweep: each block has some particles, and those around them that what happens to these depends on. All
// springs between them are shortened in shared memory, colour by colour, as in every other block that has them.
__device__ __forceinline__ void regions_limit(const Solver& s, const Part& part, const NearSprings& near, bool last) {
    real4* x = (real4*)frame_memory;
    real4* v = x + s.limit_particles_max;
    for (uint number = blockIdx.x; number < s.limit_region_count; number += gridDim.x) {
        LimitRegion region = s.limit_regions[number];
        const uint* particles = s.limit_particles + region.first_particle;
        __syncthreads();
        for (uint k = threadIdx.x; k < region.particles; k += THREADS) {
            x[k] = part.motion.x[particles[k]];
            if (k < region.owned) v[k] = part.motion.v[particles[k]];
        }
        __syncthreads();
        const uint* rows = near.rows + number * (s.limit_colours + 1);
        uint end = rows[0];
        for (uint colour = 0; colour < s.limit_colours && !part.stopped; colour++) {
            uint first = end;
            end = rows[colour + 1];
            for (uint k = first + threadIdx.x; k < end; k += THREADS) {
                uint2 spring = near.springs[k];
                uint i = spring.x & 0xffffu, j = spring.x >> 16;
                real4 a = x[i], b = x[j];
                LimitShift shift;
                if (!limit_shift(xyz(a), a.w, xyz(b), b.w, s.longest[spring.y], shift)) continue;
                x[i] = with_w(xyz(a) + shift.a, a.w);
                x[j] = with_w(xyz(b) + shift.b, b.w);
                if (i < region.owned) v[i] = limit_velocity(v[i], shift.a, part.substep.length);
                if (j < region.owned) v[j] = limit_velocity(v[j], shift.b, part.substep.length);
            }
            __syncthreads();
        }
        for (uint k = threadIdx.x; k < region.owned; k += THREADS) {
            uint i = particles[k];
            if (last) {
                part.store_last(s, i, {xyz(x[k]), xyz(v[k])}, x[k].w, v[k].w);
            } else {
                part.next_x[i] = x[k];
                part.next_v[i] = v[k];
            }
        }
    }
}

extern "C" __global__ void __launch_bounds__(THREADS, BLOCKS_PER_SM) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    __shared__ NearFrame near_frame;
    __shared__ Meeting meeting;
#if defined(CLOTH_PENALTY) || defined(CLOTH_IMPULSES)
    __shared__ real4 stages[THREADS];
    real4* stage = stages + threadIdx.x / 32 * GROUP;
#endif
#ifdef CLOTH_LIMITS
    NearSprings near_springs = NearSprings::load(s, (uint2*)((real4*)frame_memory + s.limit_particles_max + s.limit_owned_max));
#endif
    auto meet = [&] { return meeting.meet(s.status->meetings); };
    uint first = blockIdx.x * s.chunk + threadIdx.x, end = min((blockIdx.x + 1) * s.chunk, s.count);
    near_frame.start(s, substeps, threadIdx.x, THREADS);
    if (threadIdx.x == 0) meeting.start();
    copies_wait();
    __syncthreads();
    Motion motion = present_motion(s);
    real4* next_x = s.position[1 - s.present];
    real4* next_v = s.velocity[1 - s.present];
    bool stopped = *(volatile ulong*)&s.status->non_finite_step < near_frame.of(0).step;
    for (uint number = 0; number < substeps; number++) {
        bool last = number + 1 == substeps;
        Part now = {near_frame.of(number), near_frame.colliders_of(s, number), motion, next_x, next_v, stopped};
        near_frame.follow<true>(s, number, substeps, threadIdx.x, THREADS);
        uint contacts = 0;
        bool finite = true;
#ifdef CLOTH_FABRIC
        uint own = blockIdx.x * THREADS + threadIdx.x, all = gridDim.x * THREADS;
        for (uint k = own; k < s.fold_count && !now.stopped; k += all) fold_state_store(s, now.motion, k);
        meet();
        for (uint k = own; k < s.element_count && !now.stopped; k += all) {
            fold_moments_store(s, k, 1, 1, 0);
            membrane_force_store(s, now.motion, k);
        }
        meet();
        for (uint k = own; k < s.fold_count && !now.stopped; k += all) fold_force_store(s, k);
        // With penalties all meet before the pass anyway.
        if (!PENALTY) meet();
#endif
#ifdef CLOTH_PENALTY
        if (!groups_store(s, 0, now.motion.x) || s.status->built == 0) meeting.vote(VOTE_STALE);
        if (meet() & VOTE_STALE && !now.stopped) list_build(s, now.motion, 0, now.substep.tick, meet);
        if (!now.stopped) contacts_find(s, 0, stage);
        meet();
#endif
#ifdef CLOTH_IMPULSES
        uint lane = threadIdx.x & 31, warps = gridDim.x * (THREADS / 32);
        bool holds = true;
        for (uint group = threadIdx.x / 32 * gridDim.x + blockIdx.x; group < s.group_count; group += warps) {
            uint i = s.group_members[group * GROUP + lane];
            bool exists = i != NONE;
            vec3 position = exists ? particle_pass(s, now, i, contacts, finite) : make_vec3(0, 0, 0);
            holds &= group_store(s, 0, group, lane, exists, position, i);
        }
        if (!holds || s.status->built == 0) meeting.vote(VOTE_STALE);
#else
        for (uint i = first; i < end; i += THREADS) particle_pass(s, now, i, contacts, finite);
#endif
        if (!finite) meeting.vote(VOTE_STOP);
        uint agreed = meet();
        now.swap();
        now.stopped |= (agreed & VOTE_STOP) != 0;
#ifdef CLOTH_IMPULSES
        if (agreed & VOTE_STALE && !now.stopped) list_build(s, now.motion, 0, now.substep.tick, meet);
        if (!now.stopped) contacts_find(s, 0, stage);
        meet();
        for (uint i = first; i < end; i += THREADS) {
            real4 own = now.motion.x[i], rate = now.motion.v[i];
            Moved moved = {xyz(own), xyz(rate)};
            // The row has those in contact and no others.
            uint crowd = now.stopped ? 0 : s.candidate_counts[i];
            contacts += crowd;
            if (crowd > 0) impulses_apply(s, now.motion, i, own.w, crowd, s.candidate_counts, now.substep.recovery, moved);
            if (LIMITS) {
                now.next_x[i] = with_w(moved.position, own.w);
                now.next_v[i] = with_w(moved.velocity, rate.w);
            } else {
                now.store_last(s, i, moved, own.w, rate.w);
            }
        }
        meet();
        now.swap();
#endif
#ifdef CLOTH_LIMITS
        if (s.limit_region_count > 0) {
            for (uint sweep = 1; sweep <= s.limit_sweeps; sweep++) {
                regions_limit(s, now, near_springs, sweep == s.limit_sweeps);
                meet();
                now.swap();
            }
        } else {
            // What a particle depends on does not fit into shared memory, or triangles are limited too.
            colours_limit(s, now.motion, now.substep.length, now.stopped, meet);
            for (uint i = first; i < end; i += THREADS) {
                real4 own = now.motion.x[i], rate = now.motion.v[i];
                now.store_last(s, i, {xyz(own), xyz(rate)}, own.w, rate.w);
            }
            meet();
            now.swap();
        }
#endif
        if (last && contacts > 0) atomicAdd(&s.status->contacts, (ulong)contacts);
        copies_wait();
        __syncthreads();
        motion = now.motion;
        next_x = now.next_x;
        next_v = now.next_v;
        stopped = now.stopped;
    }
}
