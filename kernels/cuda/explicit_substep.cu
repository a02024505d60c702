// The composite stage: a whole frame in one launch, or one pass of a substep.
//
// All blocks are resident; each owns a run of particles. Without contact a block waits for those whose
// particles it reads, and for no others; with contact all wait for all, so that they can build the list
// together when some particle found that it does not hold.

#ifdef CLOTH_PENALTY
#define PENALTY true
#else
#define PENALTY false
#endif
#ifdef CLOTH_EXTRAS
#define EXTRAS true
#else
#define EXTRAS false
#endif
#ifdef CLOTH_TABLE
#define TABLE true
#else
#define TABLE false
#endif

extern __shared__ __align__(16) unsigned char table_memory[];

__device__ __forceinline__ void table_load(const Solver& s, const TableEntry*& table, const uint2*& headers) {
    TableEntry* entries = (TableEntry*)table_memory;
    uint2* rows = (uint2*)(entries + s.entry_count);
    if (TABLE) {
        for (uint at = threadIdx.x; at < s.entry_count; at += blockDim.x) {
            uint2 entry = s.spring_entries[at];
            real4 kind = s.spring_kinds[entry.y];
            entries[at] = {entry.x, kind.x, kind.y, kind.z};
        }
        for (uint at = threadIdx.x; at < s.header_count; at += blockDim.x) rows[at] = s.spring_headers[at];
        __syncthreads();
    }
    table = entries;
    headers = rows;
}

// Stores a particle; books a number that is not finite.
__device__ __forceinline__ void particle_store(const Solver& s, real4* x, real4* v, const SubstepData& substep, uint i, const Moved& moved, const real4& own, const real4& rate) {
    x[i] = with_w(moved.position, own.w);
    v[i] = with_w(moved.velocity, rate.w);
    if (!(is_finite(moved.position) && is_finite(moved.velocity))) atomicMin(&s.status->non_finite_step, substep.step);
}

// Few blocks for each multiprocessor, and registers in plenty: for models that do not fill the device.
#if defined(CLOTH_WIDE)
#define BLOCKS_PER_SM 1
#elif defined(CLOTH_F64)
#define BLOCKS_PER_SM 2
#else
#define BLOCKS_PER_SM 4
#endif

extern "C" __global__ void __launch_bounds__(256, BLOCKS_PER_SM) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    Motion motion = present_motion(s);
    real4* next_x = s.position[1 - s.present];
    real4* next_v = s.velocity[1 - s.present];
    const TableEntry* table;
    const uint2* headers;
    table_load(s, table, headers);
    uint first = blockIdx.x * s.chunk + threadIdx.x;
    uint end = min((blockIdx.x + 1) * s.chunk, s.count);
    if (PENALTY) {
        // Whether the list holds for the first substep; later ones are looked at by the one before.
        uint tick = s.substeps[0].tick;
        vec3 drift = {(real)s.status->drift[0], (real)s.status->drift[1], (real)s.status->drift[2]};
        bool holds = s.status->built != 0;
        uint built = s.status->built_tick;
        for (uint i = first; holds && i < end; i += blockDim.x) {
            holds = list_holds(s, drift, built, i, xyz(motion.x[i]), tick);
        }
        if (!holds) s.status->stale[tick & 3] = tick;
        grid_barrier(&s.status->barrier[0]);
    }
    for (uint number = 0; number < substeps; number++) {
        const SubstepData& substep = s.substeps[number];
        if (!PENALTY && number > 0 && s.chunk < s.count) wait_for_dependencies(s, s.epoch + number);
        // Blocks need not agree on this one while a frame goes wrong; they stand still soon after.
        bool stopped = *(volatile ulong*)&s.status->non_finite_step < substep.step;
        uint tick = substep.tick;
        if (PENALTY && !stopped && *(volatile uint*)&s.status->stale[tick & 3] == tick) {
            list_build(s, &s.status->barrier[0], motion, tick, first, end, blockDim.x);
        }
        bool last = number + 1 == substeps;
        vec3 drift = {0, 0, 0};
        uint built = 0;
        if (PENALTY) {
            drift = {(real)s.status->drift[0], (real)s.status->drift[1], (real)s.status->drift[2]};
            built = s.status->built_tick;
        }
        uint total = 0;
        bool holds = true;
        for (uint i = first; i < end; i += blockDim.x) {
            real4 own = motion.x[i];
            real4 rate = motion.v[i];
            uint contacts = 0;
            Moved moved = {xyz(own), xyz(rate)};
            if (!stopped) {
                moved = particle_advance<PENALTY, EXTRAS, TABLE>(s, table, headers, motion, substep, true, i, own, rate, contacts);
            }
            particle_store(s, next_x, next_v, substep, i, moved, own, rate);
            total += contacts;
            if (PENALTY && !last) holds &= list_holds(s, drift, built, i, moved.position, tick + 1);
        }
        if (PENALTY) {
            if (!holds) s.status->stale[(tick + 1) & 3] = tick + 1;
            if (last && total > 0) atomicAdd(&s.status->contacts, (ulong)total);
            if (!last) grid_barrier(&s.status->barrier[0]);
        } else {
            __syncthreads();
            publish(s, s.epoch + number + 1);
        }
        real4* x = next_x;
        real4* v = next_v;
        next_x = (real4*)motion.x;
        next_v = (real4*)motion.v;
        motion = {x, v};
    }
}

// One pass: all forces and integration, without colliders. For substeps in which other stages follow.
extern "C" __global__ void __launch_bounds__(256) explicit_pass(const __grid_constant__ Solver s, uint number, uint colliders) {
    const TableEntry* table;
    const uint2* headers;
    table_load(s, table, headers);
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    const SubstepData& substep = s.substeps[number];
    Motion motion = present_motion(s);
    real4 own = motion.x[i];
    real4 rate = motion.v[i];
    Moved moved = {xyz(own), xyz(rate)};
    if (!(s.status->non_finite_step < substep.step)) {
        uint contacts = 0;
        moved = particle_advance<PENALTY, EXTRAS, TABLE>(s, table, headers, motion, substep, colliders != 0, i, own, rate, contacts);
    }
    particle_store(s, s.position[1 - s.present], s.velocity[1 - s.present], substep, i, moved, own, rate);
}
