// The composite stage for a regular patch of many tiles with contact, where nothing but fields, springs, contact and colliders acts:
// a whole frame in one launch. Each substep first advances all tiles as if nothing touched, and finds the tiles in which something
// may touch (`patch/flat.cuh`): few, where cloth lies smooth. When all blocks have met, each group of these is looked at by a warp, and
// the particles that touch something are done again. As no search is in the first part, its threads have their registers to
// themselves.

// As many as leave a thread the registers that it needs.
#define BLOCKS_PER_SM 4

// What is known of the tile that comes next, in shared memory.
struct NearTile {
    real4 flat[TileFlat::WORDS];
    real4 regions[2 * TILE_GROUPS];

    // Starts to load it.
    __device__ __forceinline__ void start(const Solver& s, uint tile) {
        uint at = threadIdx.x;
        if (at < 2 * TILE_GROUPS) {
            copy_start(&regions[at], &s.group_regions[2 * TILE_GROUPS * tile + at]);
        } else if (at < 2 * TILE_GROUPS + TileFlat::WORDS) {
            at -= 2 * TILE_GROUPS;
            copy_start(&flat[at], &s.tile_flat[TileFlat::WORDS * tile + at]);
        }
    }
};

// Where a group is among those of a tile: the one of a warp at a place in its rows.
__device__ __forceinline__ uint part_of(uint warp, uint place) { return warp * PAIR / 4 * 4 + place; }

// Looks whether the particles of a thread hold what the list was made for, and their edges to the right and down are flat. `INSIDE`
// says that all are within the patch.
template <bool INSIDE>
__device__ __forceinline__ void pair_look(
    const Solver& s, const NearTile& near_tile, uint part, const real4* x, uint at, uint row, uint column, const real4* own, bool& holds, bool& flat
) {
    TileFlat asked = TileFlat::load(near_tile.flat);
    Box region = box_load(near_tile.regions, part);
#pragma unroll
    for (uint k = 0; k < PAIR; k++) {
        vec3 xi = xyz(own[k]);
        bool exists = INSIDE || row + k < s.rows && column < s.columns;
        bool right = asked.holds(s, 0, xyz(x[at + k * TILE_STRIDE + 1]) - xi);
        bool below = asked.holds(s, 1, xyz(k + 1 < PAIR ? own[PAIR - 1] : x[at + PAIR * TILE_STRIDE]) - xi);
        if (INSIDE) {
            holds &= box_holds(region, xi);
            flat &= right & below;
        } else if (exists) {
            holds &= box_holds(region, xi);
            flat &= right || column + 1 == s.columns;
            flat &= below || row + k + 1 == s.rows;
        }
    }
}

// By all threads, at the end of a run: puts its tiles in which something may touch into the list; those that are not flat with the tiles
// around. To wait for that at each tile would take long.
__device__ __forceinline__ void tiles_rough_search(const Solver& s, const StripRun& tiles, uint substep, uint tick) {
    __syncthreads();
    for (uint task = threadIdx.x; task < 9 * (tiles.end - tiles.first); task += PAIR_THREADS) {
        uint tile = tile_number(s, StripTile::of(s, tiles.first + task / 9));
        uint2 found = s.tile_rough[tile];
        if (found.x != tick || found.y == 0 && task % 9 != 4) continue;
        uint around = tile_around(s, tile, task % 9);
        if (around != NONE) tile_search(s, around, substep, tick);
    }
}

// Both parts take turns with shared memory.
#define FRAME_BYTES (2 * TILE_ENTRIES * sizeof(real4) + 3 * PAIR_FORCES * sizeof(real))
static_assert(sizeof(AroundGroup) * PAIR_WARPS <= FRAME_BYTES && sizeof(ListMemory) <= FRAME_BYTES, "what is done between tiles needs their memory");

// What follows is no part of the kernel's text, so that what it needs to remember takes no registers from the rest.

__device__ __noinline__ void list_renew(const Solver& s, Motion motion, uint substep, uint tick, Meeting& meeting) {
    tiles_list_build(s, motion, substep, tick, *(ListMemory*)frame_memory, [&] { meeting.meet(s.status->meetings); });
}

// Looks what the particles of so many tiles of the list touch, by groups, and does the substep again for those that touch something;
// for all if `again`. Gives the number of contacts.
__device__ __noinline__ uint tiles_searched(
    const Solver& s, Motion motion, real4* next_x, real4* next_v, const SubstepData& substep, const Collider* colliders, uint number, uint searched, bool again,
    bool& finite
) {
    // Tiles have no use for it at this time.
    AroundGroup& around = ((AroundGroup*)frame_memory)[threadIdx.x / 32];
    uint lane = threadIdx.x % 32, total = 0;
    real square = s.contact_distance * s.contact_distance;
    GroupsOfPatch groups = {s, motion.x};
    uint task = blockIdx.x * PAIR_WARPS + threadIdx.x / 32;
    // Who is done takes the next of those that are left.
    auto next = [&] {
        if (lane == 0) task = gridDim.x * PAIR_WARPS + atomicAdd(&s.status->taken[number % 3], 1u);
        task = __shfl_sync(ALL_LANES, task, 0);
    };
    for (; task < searched * TILE_GROUPS; next()) {
        uint group = s.tile_list[task / TILE_GROUPS] * TILE_GROUPS + task % TILE_GROUPS;
        uint row, column;
        GroupsOfPatch::place(s, group, 0, row, column);
        uint r = row + lane / 8, c = column + lane % 8;
        uint i = r * s.columns + c;
        bool inside = AroundGroup::is_inside(s, row, column), exists = inside || r < s.rows && c < s.columns;
        real4 own = exists ? motion.x[i] : real4{0, 0, 0, 0};
        uint listed = s.group_counts[group], other = lane < s.group_capacity ? s.group_rows[group * s.group_capacity + lane] : 0;
        bool is_flat = group_is_flat(s, row, column, lane, substep.tick), is_there = !is_flat;
        listed = min(listed, s.group_capacity);
        if (lane >= listed) other = group;
        __syncwarp();
        if (!is_flat) around.start(s, motion.x, row, column, lane);
        Box region = groups.box(other);
        uint mask = exists ? stencil_mask(s, r, c) : 0;
        vec3 xi = xyz(own);
        Box box = warp_box(exists, xi, xi), reach = box_grown(box, contact_reach(s, box));
        // What touches nothing of the groups around has only to look at others.
        bool clear = is_flat;
        if (!is_flat) {
            copies_wait();
            __syncwarp();
            clear = __all_sync(ALL_LANES, around.springs_least(mask, (int)lane) >= square);
            if (clear) {
                bool flat = inside ? around.is_flat<true>(s, row, column, (int)lane) : around.is_flat<false>(s, row, column, (int)lane);
                if (!__all_sync(ALL_LANES, flat)) {
                    __syncwarp();
                    clear = around.is_apart(s, row, column, lane, reach);
                    is_there = false;
                }
            }
        }
        GroupView view = {exists ? xi : make_vec3(REAL_MAX, REAL_MAX, REAL_MAX), reach};
        bool is_needed = lane < listed && !(clear && groups_are_around(s, group, other));
        uint near = __ballot_sync(ALL_LANES, is_needed && boxes_meet(view.box, region));
        if (near != 0) is_there = false;
        real4 partners[PARTNERS_NEAR];
        const real4* kept = partners;
        uint found = 0;
        // Also those that springs join to the particle.
        around_contacts_visit(s, groups, group, lane, view, near, other, listed, around, [&](uint theirs, uint member, const vec3& position) {
            uint r, c;
            GroupsOfPatch::place(s, theirs, member, r, c);
            partner_add(partners, found, with_w(position, number_pack(r * s.columns + c)));
            found++;
        });
        if (__any_sync(ALL_LANES, found > PARTNERS_NEAR)) {
            kept = nullptr;
            found = group_contacts(s, groups, group, lane, around.x);
        }
        bool is_changed = found > 0 || kept == nullptr || again;
        if (!is_there && __any_sync(ALL_LANES, is_changed)) {
            __syncwarp();
            around.start(s, motion.x, row, column, lane);
            copies_wait();
            __syncwarp();
        }
        if (!exists || !is_changed) continue;
        uint contacts = 0;
        real4 rate = motion.v[i];
        vec3 vi = xyz(rate), force = field_force(s, rate.w, vi);
        force = procedural_force(substep, i, xi, vi, rate.w, force);
        force = around.springs_add(s, motion, i, mask, (int)lane, vi, force);
        Moved moved = particle_finish<true, false>(s, motion, substep, colliders, i, own, rate, kept, found, true, force, s.offsets[0], contacts);
        finite &= particle_store(s, next_x, next_v, substep, i, moved, own.w, rate.w);
        total += contacts;
    }
    return total;
}

extern "C" __global__ void __launch_bounds__(PAIR_THREADS, BLOCKS_PER_SM) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    __shared__ NearFrame near_frame;
    __shared__ NearTile near_tile;
    // Groups of a tile that are not flat, a bit each, of tiles in turn.
    __shared__ uint rough[2];
    __shared__ Meeting meeting;
    __shared__ StripRun tiles;
    real4* x = (real4*)frame_memory;
    real4* v = x + TILE_ENTRIES;
    real* forces = (real*)(v + TILE_ENTRIES);
    real offset = s.offsets[0];
    uint lane = threadIdx.x % 32, warp = threadIdx.x / 32;
    uint at = (warp * PAIR + HALO) * TILE_STRIDE + lane + HALO;
    // Where the group of the thread's particles is among those of a tile.
    uint part = part_of(warp, lane / 8);
    // What a thread leaves here while it searches, so that it has its registers.
    __shared__ PairOuter outers[PAIR_THREADS];
    __shared__ AroundLoad all_loads[AroundLoad::TURNS][PAIR_THREADS];
    outers[threadIdx.x] = PairOuter::of_thread();
    for (uint turn = 0; turn < AroundLoad::TURNS; turn++) all_loads[turn][threadIdx.x] = AroundLoad::of_thread(turn);
    if (threadIdx.x == 0) {
        meeting.start();
        tiles = StripRun::of(s, blockIdx.x);
    }
    near_frame.start(s, substeps, threadIdx.x, PAIR_THREADS);
    bool is_built = *(volatile uint*)&s.status->built == LIST_BUILT_WITH_TILES;
    bool stopped = *(volatile ulong*)&s.status->non_finite_step < s.substeps[0].step;
    for (uint number = 0; number < substeps; number++) {
        copies_wait();
        __syncthreads();
        PairOuter outer = outers[threadIdx.x];
        AroundLoad loads[AroundLoad::TURNS];
        for (uint turn = 0; turn < AroundLoad::TURNS; turn++) loads[turn] = all_loads[turn][threadIdx.x];
        if (stopped) {
            state_carry(s, number, substeps);
            break;
        }
        uint present = state_after(s, number), next = state_after(s, number + 1);
        Motion motion = {s.position[present], s.velocity[present]};
        StripTile tile = StripTile::of(s, tiles.first);
        near_tile.start(s, tile_number(s, tile));
        strip_tile_start<true>(s, motion, tile, true, loads, x, v);
        const SubstepData& substep = near_frame.of(number);
        const Collider* colliders = near_frame.colliders_of(s, number);
        near_frame.follow<true>(s, number, substeps, threadIdx.x, PAIR_THREADS);
        bool is_first = true;
        int place = slot_first((int)warp) + (int)lane;
        uint turn = 0;
        if (threadIdx.x == 0) rough[0] = rough[1] = 0;
        for (uint run = tiles.first; run < tiles.end; run++) {
            copies_wait();
            __syncthreads();
            uint row = tile.row + warp * PAIR, column = tile.column + lane;
            bool inside = stencil_is_inside(s, tile.row, tile.column);
            bool holds = true, flat = true;
            StencilPair pair;
#pragma unroll
            for (uint k = 0; k < PAIR; k++) pair.x[k] = x[at + k * TILE_STRIDE];
            if (inside) {
                pair_look<true>(s, near_tile, part, x, at, row, column, pair.x, holds, flat);
            } else {
                pair_look<false>(s, near_tile, part, x, at, row, column, pair.x, holds, flat);
            }
#pragma unroll
            for (uint k = 0; k < PAIR; k++) pair.v[k] = v[at + k * TILE_STRIDE];
            if (!holds) meeting.vote(VOTE_STALE);
            int place_first = slot_first((int)warp) + (int)lane;
            real least = strip_springs(s, pair, x, v, at, outer, forces, place, place_first, is_first);
            flat &= least >= s.contact_distance * s.contact_distance;
            int above = slot_above(place);
            bool is_alone = TileFlat::load(near_tile.flat).is_alone;
            // A warp has rows of four groups.
            uint agreed = __ballot_sync(ALL_LANES, flat);
            if (lane < 4 && (agreed >> 8 * lane & 0xff) != 0xff) atomicOr(&rough[turn], 1u << part_of(warp, lane));
            __syncthreads();
            uint roughs = is_built ? rough[turn] : (1u << TILE_GROUPS) - 1;
            turn = 1 - turn;
            if (threadIdx.x == 0) rough[turn] = 0;
            uint tile_present = tile_number(s, tile);
            // Nobody reads this tile any more.
            tile.next(s);
            is_first = tile.row == 0;
            if (run + 1 < tiles.end) {
                near_tile.start(s, tile_number(s, tile));
                strip_tile_start<true>(s, motion, tile, is_first, loads, x, v);
            }
            if (roughs != 0 || !is_alone) {
                // Something may touch here.
                if (threadIdx.x == 0) s.tile_rough[tile_present] = {substep.tick, roughs};
            }
            bool finite = true;
#pragma unroll
            for (uint k = 0; k < PAIR; k++) {
                if (!inside && !(row + k < s.rows && column < s.columns)) continue;
                uint i = (row + k) * s.columns + column;
                Moved moved = strip_move(s, substep, colliders, pair, k, i, row + k, column, inside, forces, place, above, offset);
                s.position[next][i] = with_w(moved.position, pair.x[k].w);
                s.velocity[next][i] = with_w(moved.velocity, pair.v[k].w);
                finite &= is_finite(moved.position) && is_finite(moved.velocity);
            }
            if (!finite) {
                // Not to be booked before it is known that nothing touches.
                tile_search(s, tile_present, number, substep.tick);
                s.status->again = substep.tick;
            }
            place = above;
        }
        tiles_rough_search(s, tiles, number, substep.tick);
        uint agreed = meeting.meet(s.status->meetings);
        if (!is_built || agreed & VOTE_STALE) list_renew(s, motion, number, substep.tick, meeting);
        is_built = true;
        uint searched = *(volatile uint*)&s.status->searched[number % 3];
        bool again = *(volatile uint*)&s.status->again == substep.tick;
        if (blockIdx.x + threadIdx.x == 0) {
            // Of the substep before, which all have read.
            s.status->searched[(number + 2) % 3] = s.status->taken[(number + 2) % 3] = 0;
        }
        bool finite = true;
        uint total = tiles_searched(s, motion, s.position[next], s.velocity[next], substep, colliders, number, searched, again, finite);
        if (!finite) meeting.vote(VOTE_STOP);
        // The memory is that of tiles again.
        __syncthreads();
        if (number + 1 == substeps) {
            if (total > 0) atomicAdd(&s.status->contacts, (ulong)total);
        } else if (searched > 0) {
            stopped = (meeting.meet(s.status->meetings) & VOTE_STOP) != 0;
        }
    }
}
