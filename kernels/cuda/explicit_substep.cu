// The composite stage where one pass makes a substep: a whole frame in one launch. `explicit_substep_stages.cu` is for models in which
// stages follow the pass.
//
// All blocks are resident; each owns a run of particles, or of tiles of a regular patch, which it holds in shared
// memory with their surroundings. Without contact a block waits for those whose particles it reads, and for no
// others; with contact all wait for all, as anything may touch anything, and so that they can build the list of groups
// together when some group has left its region. In a tile with contact a warp has the particles of a group. A patch of many
// tiles with contact has a kernel of its own, `explicit_substep_flat.cu`.

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

#ifdef CLOTH_STENCIL
#define STENCIL true
#else
#define STENCIL false
#endif

// A block that has one tile has in each warp the same group all the time, and keeps what it knows of its list.
#if defined(CLOTH_PENALTY) && defined(CLOTH_MANY_REGISTERS)
#define KEEPS_GROUP
#endif

// Puts the springs of shared rows into shared memory, where all threads of a warp read the same one. In a tile an
// offset a + b columns is a + b strides.
__device__ __forceinline__ unsigned char* table_load(const Solver& s, const TableEntry*& table, const uint2*& headers) {
    TableEntry* entries = (TableEntry*)frame_memory;
    uint2* rows = (uint2*)(entries + s.entry_count);
    if (!TABLE || STENCIL) return frame_memory;
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

// Two tiles in turn, so that the next one is on its way while one is worked on. With contact the caches have more use for
// the memory.
#if defined(CLOTH_F64) || defined(CLOTH_PENALTY)
#define TILES 1
#else
#define TILES 2
#endif

// With contact there are no registers to keep what a thread loads of a tile.
#if defined(CLOTH_PENALTY) && !defined(CLOTH_MANY_REGISTERS)
#define KEEPS_LOADS false
#else
#define KEEPS_LOADS true
#endif

// A substep of one particle, with `found` partners. Gives where it gets to.
__device__ __forceinline__ vec3 substep_store(
    const Solver& s, const TableEntry* table, const uint2* headers, const Motion& motion, const SubstepData& substep, const Collider* colliders,
    const real4* x, const real4* v, uint at, uint i, const real4* partners, uint found, bool stopped, real4* next_x, real4* next_v, uint& total, bool& finite
) {
    real4 own = x[at], rate = v[at];
    uint contacts = 0;
    Moved moved = {xyz(own), xyz(rate)};
    if (!stopped) {
        moved = particle_advance<PENALTY, EXTRAS, TABLE>(s, table, headers, motion, substep, colliders, x, v, at, i, own, rate, partners, found, contacts);
    }
    finite &= particle_store(s, next_x, next_v, substep, i, moved, own.w, rate.w);
    total += contacts;
    return moved.position;
}

// Few blocks for each multiprocessor, and registers in plenty: for models that do not fill the device.
#if defined(CLOTH_MANY_REGISTERS)
#define BLOCKS_PER_SM 1
#elif defined(CLOTH_F64)
#define BLOCKS_PER_SM 2
#else
#define BLOCKS_PER_SM 4
#endif

extern "C" __global__ void __launch_bounds__(256, BLOCKS_PER_SM) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    __shared__ NearFrame near_frame;
#ifdef CLOTH_PENALTY
    __shared__ real4 stages[256];
    __shared__ Meeting meeting;
    auto meet = [&] { return meeting.meet(s.status->meetings); };
#else
    real4* stages = nullptr;
#endif
    const TableEntry* table = nullptr;
    const uint2* headers = nullptr;
    real4* tiles = (real4*)table_load(s, table, headers);
#ifdef CLOTH_STENCIL
    real* forces = (real*)(tiles + TILES * 2 * TILE_ENTRIES);
    real offset = s.offsets[0];
    StencilOuter outer = StencilOuter::of_thread();
#endif
    Motion motion = present_motion(s);
    real4* next_x = s.position[1 - s.present];
    real4* next_v = s.velocity[1 - s.present];
    uint lane = threadIdx.x & 31, warp = threadIdx.x / 32;
    TileLoad loads[LOADS];
    for (uint number = 0; number < LOADS; number++) loads[number] = TileLoad::of_thread(s, number);
    uint across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
    // Runs of 256 particles, or tiles.
    uint first = blockIdx.x * s.chunk;
    uint end = first + s.chunk;
    uint step = GRID ? 1 : blockDim.x;
    end = min(end, GRID ? across * ((s.rows + TILE_ROWS - 1) / TILE_ROWS) : s.count);
    bool stopped = false;
#ifdef CLOTH_PENALTY
    if (threadIdx.x == 0) meeting.start();
    __syncthreads();
    // Whether the list holds for the first substep; later ones are looked at by the one before.
    if (!groups_store(s, 0, motion.x) || s.status->built == 0) meeting.vote(VOTE_STALE);
    uint agreed = meet();
#endif
    near_frame.start(s, substeps, threadIdx.x, blockDim.x);
    // Of the positions by group, those that hold.
    uint side = 0;
#ifdef KEEPS_GROUP
    // Of the list of the warp's group, its length, and the entry of the lane.
    uint listed = 0, listed_first = 0;
#endif
    for (uint number = 0; number < substeps; number++) {
        copies_wait();
        if (!PENALTY && number > 0) wait_for_dependencies(s, s.epoch + number);
        else __syncthreads();
        const SubstepData& substep = near_frame.of(number);
        const Collider* colliders = near_frame.colliders_of(s, number);
        near_frame.follow<true>(s, number, substeps, threadIdx.x, blockDim.x);
        // Without contact a frame goes to its end; with it, blocks agree on when something went wrong.
        if (number == 0) stopped = *(volatile ulong*)&s.status->non_finite_step < substep.step;
#ifdef CLOTH_PENALTY
        stopped |= (agreed & VOTE_STOP) != 0;
        bool stale = !stopped && (agreed & VOTE_STALE) != 0;
        if (stale) list_build(s, motion, side, substep.tick, meet);
#ifdef KEEPS_GROUP
        uint own_group = first * (TILE_COLUMNS * TILE_ROWS / GROUP) + warp;
        if (GRID && (number == 0 || stale)) {
            listed = list_count(s, own_group);
            listed_first = list_entry(s, own_group, lane, 0, listed);
        }
#endif
        if (!GRID) {
            contacts_find(s, side, stages + warp * GROUP);
            meet();
        }
#endif
        bool last = number + 1 == substeps;
        uint total = 0;
        bool finite = true, holds = true;
        TilePlace place = GRID ? TilePlace{first % across, first / across} : TilePlace{0, 0};
        if (GRID && TILES == 2) tile_start<KEEPS_LOADS>(s, motion, place, loads, tiles, tiles + TILE_ENTRIES);
        uint turn = 0;
        for (uint run = first; run < end; run += step) {
            uint i = run + threadIdx.x;
            bool exists = i < end;
            const real4* x = motion.x;
            const real4* v = motion.v;
            uint at = i;
#ifdef KEEPS_GROUP
            GroupView view;
            NearGroups near_groups;
#endif
#ifdef CLOTH_STENCIL
            uint tile_row = 0, tile_column = 0;
            bool inside = false;
            vec3 springs[STENCIL_KINDS];
#endif
            if (GRID) {
                real4* tile = tiles + 2 * TILE_ENTRIES * turn;
                if (TILES == 1) {
                    __syncthreads();
                    tile_start<KEEPS_LOADS>(s, motion, place, loads, tile, tile + TILE_ENTRIES);
                }
                copies_wait();
                __syncthreads();
                uint c = threadIdx.x % TILE_COLUMNS, r = threadIdx.x / TILE_COLUMNS;
                if (PENALTY) tile_place_in_group(c, r);
                uint column = place.column * TILE_COLUMNS + c, row = place.row * TILE_ROWS + r;
                place.next(across);
                if (TILES == 2) {
                    turn = 1 - turn;
                    real4* other = tiles + 2 * TILE_ENTRIES * turn;
                    if (run + 1 < end) tile_start<KEEPS_LOADS>(s, motion, place, loads, other, other + TILE_ENTRIES);
                }
                exists = column < s.columns && row < s.rows;
                i = row * s.columns + column;
                at = (r + HALO) * TILE_STRIDE + c + HALO;
                x = tile;
                v = tile + TILE_ENTRIES;
#ifdef KEEPS_GROUP
                // What is far away comes while springs are worked on.
                view = GroupView::of(s, GroupsStored{s, side}, own_group, lane);
                near_groups = NearGroups::of(GroupsStored{s, side}, view.box, lane, lane < listed, listed_first);
#endif
#ifdef CLOTH_STENCIL
                tile_row = r;
                tile_column = c;
                inside = stencil_is_inside(s, row - r, column - c);
                stencil_springs(s, x, v, r, c, outer, forces, springs);
                __syncthreads();
#endif
            }
            if (PENALTY && GRID) {
                uint group = run * (TILE_COLUMNS * TILE_ROWS / GROUP) + warp;
                real4 partners[PARTNERS_NEAR];
                const real4* kept = partners;
                uint found = 0;
                if (!stopped) {
                    // Also those that springs join to the particle.
#ifndef KEEPS_GROUP
                    uint listed = list_count(s, group);
                    GroupView view = GroupView::of(s, GroupsStored{s, side}, group, lane);
                    NearGroups near_groups = NearGroups::of(GroupsStored{s, side}, view.box, lane, lane < listed, list_entry(s, group, lane, 0, listed));
#endif
                    group_contacts_visit(s, GroupsStored{s, side}, group, lane, view, near_groups, listed, stages + warp * GROUP, [&](uint, uint, const real4& partner) {
                        partner_add(partners, found, partner);
                        found++;
                    });
                    if (__any_sync(ALL_LANES, found > PARTNERS_NEAR)) {
                        kept = nullptr;
                        found = group_contacts(s, GroupsStored{s, side}, group, lane, stages + warp * GROUP);
                    }
                }
                vec3 position = {0, 0, 0};
#ifdef CLOTH_STENCIL
                if (exists) {
                    position = stencil_substep_store<PENALTY, EXTRAS, false>(
                        s, motion, substep, colliders, x[at], v[at], i, kept, found, stopped, next_x, next_v, total, finite,
                        forces, tile_row, tile_column, inside, nullptr, offset
                    );
                }
#else
                if (exists) position = substep_store(s, table, headers, motion, substep, colliders, x, v, at, i, kept, found, stopped, next_x, next_v, total, finite);
#endif
                if (!last) holds &= group_store(s, 1 - side, group, lane, exists, position, i);
            } else if (exists) {
                uint found = PENALTY ? s.candidate_counts[i] : 0;
#ifdef CLOTH_STENCIL
                stencil_substep_store<PENALTY, EXTRAS, true>(
                    s, motion, substep, colliders, x[at], v[at], i, nullptr, found, stopped, next_x, next_v, total, finite,
                    forces, tile_row, tile_column, inside, springs, offset
                );
#else
                substep_store(s, table, headers, motion, substep, colliders, x, v, at, i, nullptr, found, stopped, next_x, next_v, total, finite);
#endif
            }
        }
#ifdef CLOTH_PENALTY
        if (!finite) meeting.vote(VOTE_STOP);
        if (GRID) side = 1 - side;
        if (last) {
            if (total > 0) atomicAdd(&s.status->contacts, (ulong)total);
        } else {
            agreed = 0;
            if (!GRID) {
                agreed = meet();
                holds = groups_store(s, side, next_x);
            }
            if (!holds) meeting.vote(VOTE_STALE);
            agreed |= meet();
        }
#else
        publish(s, s.epoch + number + 1);
#endif
        real4* x = next_x;
        real4* v = next_v;
        next_x = (real4*)motion.x;
        next_v = (real4*)motion.v;
        motion = {x, v};
    }
}
