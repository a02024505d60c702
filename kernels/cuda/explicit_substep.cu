// The composite stage: a whole frame in one launch, or one pass of a substep.
//
// All blocks are resident; each owns a run of particles, or of tiles of a regular patch, which it holds in shared
// memory with their surroundings. Without contact a block waits for those whose particles it reads, and for no
// others; with contact all wait for all, so that they can build the list together when some particle found that
// it does not hold.

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

#ifdef CLOTH_GRID
#define GRID true
#else
#define GRID false
#endif

// A tile of a patch and two particles around it.
#define TILE_COLUMNS 32
#define TILE_ROWS 8
#define HALO 2
#define TILE_STRIDE (TILE_COLUMNS + 2 * HALO)
#define TILE_ENTRIES (TILE_STRIDE * (TILE_ROWS + 2 * HALO))
// Colliders that are kept in shared memory.
#define COLLIDERS_NEAR 4

extern __shared__ __align__(16) unsigned char frame_memory[];

// Puts the springs of shared rows into shared memory, where all threads of a warp read the same one. In a tile an
// offset a + b columns is a + b strides.
__device__ __forceinline__ unsigned char* table_load(const Solver& s, const TableEntry*& table, const uint2*& headers) {
    TableEntry* entries = (TableEntry*)frame_memory;
    uint2* rows = (uint2*)(entries + s.entry_count);
    if (!TABLE) return frame_memory;
    int columns = (int)s.columns;
    for (uint at = threadIdx.x; at < s.entry_count; at += blockDim.x) {
        uint2 entry = s.spring_entries[at];
        real4 kind = s.spring_kinds[entry.y];
        int offset = (int)entry.x;
        if (GRID) {
            int shifted = offset + HALO + 4 * columns;
            offset = shifted % columns - HALO + (shifted / columns - 4) * TILE_STRIDE;
        }
        entries[at] = {(uint)offset, kind.x, kind.y, kind.z};
    }
    for (uint at = threadIdx.x; at < s.header_count; at += blockDim.x) rows[at] = s.spring_headers[at];
    __syncthreads();
    table = entries;
    headers = rows;
    return (unsigned char*)(rows + ((s.header_count + 1) & ~1u));
}

// Two tiles in turn, so that the next one is on its way while one is worked on.
#ifdef CLOTH_F64
#define TILES 1
#else
#define TILES 2
#endif

__device__ __forceinline__ void copy_start(real4* to, const real4* from) {
    for (uint part = 0; part < sizeof(real4) / 16; part++) {
        uint address = (uint)__cvta_generic_to_shared((char*)to + 16 * part);
        asm volatile("cp.async.cg.shared.global [%0], [%1], 16;" : : "r"(address), "l"((const char*)from + 16 * part) : "memory");
    }
}

__device__ __forceinline__ void copies_wait() { asm volatile("cp.async.wait_all;" : : : "memory"); }

// A tile by its place in the patch.
struct TilePlace {
    uint column;
    uint row;

    __device__ __forceinline__ void next(uint across) {
        column++;
        if (column == across) {
            column = 0;
            row++;
        }
    }
};

// Starts to load a tile with its surroundings.
__device__ __forceinline__ void tile_start(const Solver& s, const Motion& motion, const TilePlace& place, real4* x, real4* v) {
    int column = (int)(place.column * TILE_COLUMNS) - HALO, row = (int)(place.row * TILE_ROWS) - HALO;
    for (uint entry = threadIdx.x; entry < TILE_ENTRIES; entry += blockDim.x) {
        int c = column + (int)(entry % TILE_STRIDE), r = row + (int)(entry / TILE_STRIDE);
        if ((uint)c < s.columns && (uint)r < s.rows) {
            uint j = (uint)r * s.columns + (uint)c;
            copy_start(&x[entry], &motion.x[j]);
            copy_start(&v[entry], &motion.v[j]);
        }
    }
}

// Copies words; all threads of the block take part.
__device__ __forceinline__ void words_copy(void* to, const void* from, uint bytes) {
    for (uint at = threadIdx.x; at < bytes / 4; at += blockDim.x) ((uint*)to)[at] = ((const uint*)from)[at];
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
    __shared__ SubstepData substep;
    __shared__ Collider near[COLLIDERS_NEAR];
    const TableEntry* table = nullptr;
    const uint2* headers = nullptr;
    real4* tiles = (real4*)table_load(s, table, headers);
    Motion motion = present_motion(s);
    real4* next_x = s.position[1 - s.present];
    real4* next_v = s.velocity[1 - s.present];
    uint thread = blockIdx.x * blockDim.x + threadIdx.x;
    uint threads = gridDim.x * blockDim.x;
    uint across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
    // Runs of 256 particles, or tiles.
    uint first = blockIdx.x * s.chunk;
    uint end = first + s.chunk;
    uint step = GRID ? 1 : blockDim.x;
    end = min(end, GRID ? across * ((s.rows + TILE_ROWS - 1) / TILE_ROWS) : s.count);
    if (PENALTY) {
        // Whether the list holds for the first substep; later ones are looked at by the one before.
        uint tick = s.substeps[0].tick;
        ListState list = list_state(s);
        bool holds = s.status->built != 0;
        for (uint i = thread; holds && i < s.count; i += threads) {
            holds = list_holds(s, list, i, xyz(motion.x[i]), tick);
        }
        if (!holds) s.status->stale[tick & 3] = tick;
        grid_barrier(&s.status->barrier[0]);
    }
    bool stopped = false;
    for (uint number = 0; number < substeps; number++) {
        words_copy(&substep, &s.substeps[number], sizeof(SubstepData));
        const Collider* colliders = s.colliders + s.substeps[number].collider_first;
        if (s.collider_count <= COLLIDERS_NEAR) {
            words_copy(near, colliders, s.collider_count * sizeof(Collider));
            colliders = near;
        }
        if (!PENALTY && number > 0) wait_for_dependencies(s, s.epoch + number);
        else __syncthreads();
        // Without contact a frame goes to its end; with it, blocks agree on when something went wrong.
        if (PENALTY || number == 0) stopped = *(volatile ulong*)&s.status->non_finite_step < substep.step;
        uint tick = substep.tick;
        if (PENALTY && !stopped && *(volatile uint*)&s.status->stale[tick & 3] == tick) {
            list_build(s, &s.status->barrier[0], motion, tick, thread, s.count, threads);
        }
        bool last = number + 1 == substeps;
        ListState list = {{0, 0, 0}, 0, 0};
        if (PENALTY) list = list_state(s);
        uint total = 0;
        bool holds = true;
        TilePlace place = GRID ? TilePlace{first % across, first / across} : TilePlace{0, 0};
        if (GRID && TILES == 2) tile_start(s, motion, place, tiles, tiles + TILE_ENTRIES);
        uint turn = 0;
        for (uint run = first; run < end; run += step) {
            uint i = run + threadIdx.x;
            bool exists = i < end;
            const real4* x = motion.x;
            const real4* v = motion.v;
            uint at = i;
            if (GRID) {
                real4* tile = tiles + 2 * TILE_ENTRIES * turn;
                if (TILES == 1) {
                    __syncthreads();
                    tile_start(s, motion, place, tile, tile + TILE_ENTRIES);
                }
                copies_wait();
                __syncthreads();
                uint c = threadIdx.x % TILE_COLUMNS, r = threadIdx.x / TILE_COLUMNS;
                uint column = place.column * TILE_COLUMNS + c, row = place.row * TILE_ROWS + r;
                place.next(across);
                if (TILES == 2) {
                    turn = 1 - turn;
                    real4* other = tiles + 2 * TILE_ENTRIES * turn;
                    if (run + 1 < end) tile_start(s, motion, place, other, other + TILE_ENTRIES);
                }
                exists = column < s.columns && row < s.rows;
                i = row * s.columns + column;
                at = (r + HALO) * TILE_STRIDE + c + HALO;
                x = tile;
                v = tile + TILE_ENTRIES;
            }
            if (!exists) continue;
            real4 own = x[at], rate = v[at];
            uint contacts = 0;
            Moved moved = {xyz(own), xyz(rate)};
            if (!stopped) {
                moved = particle_advance<PENALTY, EXTRAS, TABLE>(s, table, headers, motion, substep, colliders, x, v, at, i, own, rate, contacts);
            }
            particle_store(s, next_x, next_v, substep, i, moved, own, rate);
            total += contacts;
            if (PENALTY && !last) holds &= list_holds(s, list, i, moved.position, tick + 1);
        }
        if (PENALTY) {
            if (!holds) s.status->stale[(tick + 1) & 3] = tick + 1;
            if (last && total > 0) atomicAdd(&s.status->contacts, (ulong)total);
            if (!last) grid_barrier(&s.status->barrier[0]);
        } else {
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
extern "C" __global__ void __launch_bounds__(256) explicit_pass(const __grid_constant__ Solver s, uint number) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    const SubstepData& substep = s.substeps[number];
    Motion motion = present_motion(s);
    real4 own = motion.x[i];
    real4 rate = motion.v[i];
    Moved moved = {xyz(own), xyz(rate)};
    if (!(s.status->non_finite_step < substep.step)) {
        uint contacts = 0;
        moved = particle_advance<PENALTY, EXTRAS, false>(s, nullptr, nullptr, motion, substep, nullptr, motion.x, motion.v, i, i, own, rate, contacts);
    }
    particle_store(s, s.position[1 - s.present], s.velocity[1 - s.present], substep, i, moved, own, rate);
}
