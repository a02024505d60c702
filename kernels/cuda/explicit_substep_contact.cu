// The composite stage for a regular patch of few tiles in contact with itself, by penalties: a whole frame in one launch, in which
// each block keeps a tile in shared memory from substep to substep, and the lists of groups near those of its tile.
//
// Half of the warps compute springs and move the particles, a row of the tile each; the others search for partners, those of a group
// each: while particles around the tile are on their way in the tile, then around it, then in other groups that are near. Particles
// travel in packets that carry the number of their substep (`shared/packet.cuh`), so that nobody waits for a block whose particles it
// does not read, but for this: a block moves its particles only when all have said that their groups were within their regions, and
// that they have read what is then written over. What was searched with lists that did not hold is searched once more.

extern __shared__ __align__(16) unsigned char frame_memory[];

// A warp for each row of the tile, and one that searches for each group.
#define WARPS (TILE_ROWS + TILE_GROUPS)

// Barriers: of the warps that compute springs, and of those that search; those at which the former tell the latter that the tile has
// moved, and that what is around it is there; and that of all, where a substep is known but for what it does to the particles.
#define BARRIER_SPRINGS 1
#define BARRIER_SEARCH 2
#define BARRIER_MOVED 3
#define BARRIER_AROUND 4
#define BARRIER_FORCES 5

// What the threads of a block have in shared memory beside the arrays of dynamic size.
struct Shared {
    NearFrame frame;
    // Of the groups of the tile: where partners of other groups' regions may be, and the regions they are expected to stay in.
    Box reaches[TILE_GROUPS];
    Box regions[TILE_GROUPS];
    // Groups in their lists.
    uint listed[TILE_GROUPS];
    // Contact forces on the particles, row by row, and how many partners they have.
    vec3 forces[TILE_PARTICLES];
    uint contacts[TILE_PARTICLES];
    // What warps have to say, and how many have; and what all blocks have said in two substeps in turn.
    uint vote;
    uint agreed[2];
    uint total;
};

// Makes the lists of groups that may come near those of the tile, but for those around each. All warps that search take part, in all
// blocks; `region` is that of the group of the warp.
__device__ __forceinline__ void lists_make(
    const Solver& s, Shared& shared, unsigned short* lists, const GroupPlace& tile, const Box& region, uint part, uint lane, uint number
) {
    uint4* packets = AreaPackets::regions(s);
    box_send(packets, blockIdx.x * TILE_GROUPS + part, lane, region, number);
    if (lane == 0) {
        shared.regions[part] = region;
        shared.reaches[part] = box_grown(region, contact_reach(s, region));
        shared.listed[part] = 0;
    }
    team_wait(BARRIER_SEARCH, TILE_PARTICLES);
    // What is far from all groups of the tile is not looked at by each.
    const Box& one = shared.reaches[lane % TILE_GROUPS];
    Box reach = warp_box(true, one.low, one.high);
    uint thread = part * GROUP + lane;
    Coming coming;
    if (thread < s.group_count) coming.ask(packets + 2 * thread, packets + 2 * thread + 1);
    for (uint other = thread; other < s.group_count; other += TILE_PARTICLES) {
        Coming next;
        uint after = other + TILE_PARTICLES;
        if (after < s.group_count) next.ask(packets + 2 * after, packets + 2 * after + 1);
        Box theirs;
        coming.wait(packets + 2 * other, packets + 2 * other + 1, number, theirs.low, theirs.high);
        coming = next;
        if (!boxes_meet(reach, theirs)) continue;
        GroupPlace place = GroupPlace::of(s, other);
#pragma unroll 1
        for (uint k = 0; k < TILE_GROUPS; k++) {
            if (!boxes_meet(shared.reaches[k], theirs)) continue;
            GroupPlace own = AreaGroup::of_tile(k).place(tile.row, tile.column);
            bool is_around = place.row + GROUP_ROWS - own.row <= 2 * GROUP_ROWS && place.column + GROUP_COLUMNS - own.column <= 2 * GROUP_COLUMNS;
            if (!is_around) lists[k * s.group_count + atomicAdd(&shared.listed[k], 1u)] = (unsigned short)other;
        }
    }
    if (blockIdx.x + thread == 0) s.status->rebuilds++;
    team_wait(BARRIER_SEARCH, TILE_PARTICLES);
}

// The sum of a number over the lanes before this one.
__device__ __forceinline__ uint lanes_before(uint number, uint lane) {
    uint sum = number;
#pragma unroll
    for (uint step = 1; step < 32; step *= 2) {
        uint before = __shfl_sync(ALL_LANES, sum, lane - step);
        if (lane >= step) sum += before;
    }
    return sum - number;
}

// What all blocks have said in a substep.
__device__ __forceinline__ uint agreed(const Shared& shared, uint number) { return *(volatile const uint*)&shared.agreed[number & 1]; }

// The particle of a thread in the tile, at a row and column.
struct Own {
    uint row;
    uint column;
    uint i;
    uint at;
    bool exists;

    __device__ __forceinline__ static Own of(const Solver& s, const GroupPlace& tile, uint row, uint column) {
        uint r = tile.row + row, c = tile.column + column;
        return {row, column, r * s.columns + c, (row + GROUP_ROWS) * AREA_STRIDE + column + GROUP_COLUMNS, r < s.rows && c < s.columns};
    }
    // Its number, row by row.
    __device__ __forceinline__ uint number() const { return row * TILE_COLUMNS + column; }
    // The group of the tile that it is in.
    __device__ __forceinline__ uint part() const { return row / GROUP_ROWS * 4 + column / GROUP_COLUMNS; }
};

// What a warp that computes springs does in a frame. Says whether it was stopped.
__device__ __forceinline__ bool rows_advance(const Solver& s, uint substeps, Shared& shared, const GroupPlace& tile, real4* x, real4* v, real* forces) {
    uint lane = threadIdx.x & 31, warp = threadIdx.x / 32;
    Own own = Own::of(s, tile, warp, lane);
    real inverse_mass = x[own.at].w, mass = v[own.at].w;
    bool inside = stencil_is_inside(s, tile.row, tile.column);
    uint mask = stencil_mask(s, tile.row + own.row, tile.column + own.column);
    real offset = s.offsets[0];
    StencilOuter outer = StencilOuter::of_thread<AREA_STRIDE>();
    // Where the tile and what springs reach of its surroundings start in the area.
    const uint stencil_first = (GROUP_ROWS - HALO) * AREA_STRIDE + GROUP_COLUMNS - HALO;
    // Sends the particle of the thread, and what the block has to say when all its rows have come here.
    auto send = [&](const AreaPackets& packets, const vec3& position, const vec3& velocity, bool stays, bool finite) {
        if (own.exists) {
            packet_send(packets.positions + own.i, position, packets.number);
            packet_send(packets.velocities + own.i, velocity, packets.number);
        }
        bool is_stale = __any_sync(ALL_LANES, !stays), stops = __any_sync(ALL_LANES, !finite);
        if (lane != 0) return;
        uint said = 1 + (is_stale ? 1u << 8 : 0) + (stops ? 1u << 16 : 0);
        uint all = said + atomicAdd(&shared.vote, said);
        if ((all & 255u) < TILE_ROWS) return;
        shared.vote = 0;
        pair_store(packets.votes + blockIdx.x, (all >> 8 & 255u ? VOTE_STALE : 0) | (all >> 16 ? VOTE_STOP : 0), packets.number);
    };
    send(AreaPackets::of(s, (uint)s.epoch + 1), xyz(x[own.at]), xyz(v[own.at]), true, true);
#pragma unroll 1
    for (uint number = 0; number < substeps; number++) {
        AreaPackets packets = AreaPackets::of(s, (uint)s.epoch + number + 1);
        if (number > 0) {
            Coming coming[2];
            uint entries[2], numbers[2];
            bool takes[2];
#pragma unroll
            for (uint which = 0; which < 2; which++) {
                AreaGroup around = AreaGroup::around(warp, which);
                GroupPlace there = around.place(tile.row, tile.column);
                takes[which] = there.has(s, lane);
                entries[which] = around.entry(lane);
                numbers[which] = there.particle(s, lane);
                if (takes[which]) packets.particle_ask(numbers[which], coming[which]);
            }
#pragma unroll
            for (uint which = 0; which < 2; which++) {
                if (!takes[which]) continue;
                vec3 position, velocity;
                packets.particle_wait(numbers[which], coming[which], position, velocity);
                x[entries[which]] = with_w(position, 0);
                v[entries[which]] = with_w(velocity, 0);
            }
            team_arrive(BARRIER_AROUND, WARPS * 32);
            team_wait(BARRIER_SPRINGS, TILE_PARTICLES);
        }
        const SubstepData& substep = shared.frame.of(number);
        vec3 springs[STENCIL_KINDS];
        stencil_springs<AREA_STRIDE>(s, x + stencil_first, v + stencil_first, own.row, own.column, outer, forces, springs);
        team_wait(BARRIER_SPRINGS, TILE_PARTICLES);
        vec3 xi = xyz(x[own.at]), vi = xyz(v[own.at]);
        vec3 force = field_force(s, mass, vi);
        force = procedural_force(substep, own.i, xi, vi, mass, force);
        if (inside) {
            force = stencil_sum<true, true>(forces, own.row, own.column, 0, springs, force);
        } else {
            force = stencil_sum<false, true>(forces, own.row, own.column, mask, springs, force);
        }
        team_wait(BARRIER_FORCES, WARPS * 32);
        uint said = agreed(shared, number);
        if (said & VOTE_STOP) return true;
        // Others search once more.
        if (said & VOTE_STALE) team_wait(BARRIER_FORCES, WARPS * 32);
        uint contacts = shared.contacts[own.number()];
        if (contacts > 0) force = force + shared.forces[own.number()];
        Moved moved = integrate(substep.length, inverse_mass, force, xi, vi);
        if (own.exists && inverse_mass > 0) collide_all<false>(s, shared.frame.colliders_of(s, number), own.i, offset, inverse_mass, moved);
        bool finite = !own.exists || is_finite(moved.position) && is_finite(moved.velocity);
        if (!finite) atomicMin(&s.status->non_finite_step, substep.step);
        x[own.at] = with_w(moved.position, inverse_mass);
        v[own.at] = with_w(moved.velocity, mass);
        if (number + 1 == substeps) {
            if (own.exists && contacts > 0) atomicAdd(&shared.total, contacts);
            break;
        }
        team_arrive(BARRIER_MOVED, WARPS * 32);
        // Written so that what is not a number is not within.
        bool stays = !own.exists || box_holds(shared.regions[own.part()], moved.position);
        send(AreaPackets::of(s, packets.number + 1), moved.position, moved.velocity, stays, finite);
    }
    return false;
}

// What a warp that searches does in a frame.
__device__ __forceinline__ void groups_search(const Solver& s, uint substeps, Shared& shared, AreaSearch& search, unsigned short* lists, uint part, uint particle) {
    uint lane = search.lane;
    bool reads_ahead = part == TILE_GROUPS - 1;
#pragma unroll 1
    for (uint number = 0; number < substeps; number++) {
        AreaPackets packets = AreaPackets::of(s, (uint)s.epoch + number + 1);
        // The lists are made at the start of a frame, and where they turn out not to hold.
        bool holds = number > 0, again = false;
        while (true) {
            bool waits = number > 0 && !again;
            if (!holds) {
                Box region = region_of(s, search.exists, xyz(search.x[search.at]), xyz(search.v[search.at]));
                lists_make(s, shared, lists, search.tile, region, part, lane, packets.number);
            }
            if (waits) team_wait(BARRIER_MOVED, WARPS * 32);
            Box box = search.start(s);
            box_send(packets.boxes, blockIdx.x * TILE_GROUPS + part, lane, box, packets.number);
            uint listed = 0, other = NONE, block = part * GROUP + lane;
            Coming coming;
            ulong said = 0, told = packets.number;
            // First what is in the tile, then what is around it.
#pragma unroll 1
            for (uint around = 0; around < 2; around++) {
                if (around) {
                    if (waits) team_wait(BARRIER_AROUND, WARPS * 32);
                    listed = shared.listed[part];
                    other = search.listed_group(0, listed);
                    if (other != NONE) coming.ask(packets.boxes + 2 * other, packets.boxes + 2 * other + 1);
                    if (block < gridDim.x) pair_load(packets.votes + block, said, told);
                }
                search.take_around(s, around ? search.order_in_tile : 0, around ? 8 : search.order_in_tile);
                search.compare();
            }
            if (reads_ahead && !again) shared.frame.follow<false>(s, number, substeps, lane, 32);
#pragma unroll 1
            for (uint first = 0; first < listed; first += 32) {
                if (first > 0) {
                    other = search.listed_group(first, listed);
                    if (other != NONE) coming.ask(packets.boxes + 2 * other, packets.boxes + 2 * other + 1);
                }
                uint near = search.near_groups(packets, other, coming);
                if (near != 0) search.find_far(s, packets, other, near);
            }
            ContactSum sum = {{0, 0, 0}, 0};
            if (__any_sync(ALL_LANES, search.found > 0)) {
                uint start = lanes_before(search.found, lane), total = __shfl_sync(ALL_LANES, start + search.found, 31);
                if (__any_sync(ALL_LANES, search.found > AREA_PARTNERS) || total > AREA_MEMBERS) {
                    sum = AreaSearch::sum_many(s, search, packets, listed);
                } else {
                    sum = search.sum(s, packets, start, total);
                }
            }
            shared.contacts[particle] = sum.contacts;
            if (sum.contacts > 0) shared.forces[particle] = sum.force;
            while (block < gridDim.x) {
                while ((uint)told != packets.number) pair_load(packets.votes + block, said, told);
                if (said != 0) atomicOr(&shared.agreed[number & 1], (uint)said);
                block += TILE_PARTICLES;
                told = packets.number - 1;
            }
            team_wait(BARRIER_FORCES, WARPS * 32);
            uint all = agreed(shared, number);
            if (all & VOTE_STOP) return;
            if (again || !(all & VOTE_STALE)) break;
            again = true;
            holds = false;
        }
        if (reads_ahead && lane == 0) shared.agreed[(number + 1) & 1] = 0;
    }
}

extern "C" __global__ void __launch_bounds__(WARPS * 32, 1) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    __shared__ Shared shared;
    const uint kept_entries = AREA_ENTRIES + TILE_GROUPS * AREA_FAR;
    real4* x = (real4*)frame_memory;
    real4* v = x + kept_entries;
    real4* members = v + kept_entries;
    uint* keys = (uint*)(members + TILE_GROUPS * AREA_MEMBERS);
    uint* partners = keys + TILE_GROUPS * AREA_MEMBERS;
    real* forces = (real*)(partners + AREA_PARTNERS * TILE_PARTICLES);
    unsigned short* lists = (unsigned short*)(forces + 3 * STENCIL_FORCES);
    uint across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
    GroupPlace tile = {blockIdx.x / across * TILE_ROWS, blockIdx.x % across * TILE_COLUMNS};
    Motion motion = present_motion(s);
    for (uint entry = threadIdx.x; entry < AREA_ENTRIES; entry += blockDim.x) {
        uint column = tile.column + entry % AREA_STRIDE - GROUP_COLUMNS, row = tile.row + entry / AREA_STRIDE - GROUP_ROWS;
        bool exists = column < s.columns && row < s.rows;
        x[entry] = exists ? motion.x[row * s.columns + column] : real4{0, 0, 0, 0};
        v[entry] = exists ? motion.v[row * s.columns + column] : real4{0, 0, 0, 0};
    }
    uint lane = threadIdx.x & 31, warp = threadIdx.x / 32;
    if (warp == WARPS - 1) {
        shared.frame.start(s, substeps, lane, 32);
        if (lane == 0) {
            shared.vote = shared.agreed[0] = shared.agreed[1] = shared.total = 0;
            if (blockIdx.x == 0) {
                s.status->candidates = 0;
                // Before any block can see that this one is there.
                __threadfence();
            }
        }
    }
    __syncthreads();
    bool stopped = *(volatile ulong*)&s.status->non_finite_step < shared.frame.of(0).step;
    if (warp < TILE_ROWS) {
        if (!stopped) stopped = rows_advance(s, substeps, shared, tile, x, v, forces);
        Own own = Own::of(s, tile, warp, lane);
        if (own.exists) {
            s.position[state_after(s, substeps)][own.i] = x[own.at];
            s.velocity[state_after(s, substeps)][own.i] = v[own.at];
        }
    } else if (!stopped) {
        uint part = warp - TILE_ROWS;
        Own own = Own::of(s, tile, part / 4 * GROUP_ROWS + lane / GROUP_COLUMNS, part % 4 * GROUP_COLUMNS + lane % GROUP_COLUMNS);
        AreaSearch search;
        search.x = x;
        search.v = v;
        search.members = members + part * AREA_MEMBERS;
        search.keys = keys + part * AREA_MEMBERS;
        search.partners = partners + own.number();
        search.list = lists + part * s.group_count;
        search.tile = tile;
        search.group = AreaGroup::of_tile(part);
        search.lane = lane;
        search.at = own.at;
        search.exists = own.exists;
        search.far_first = AREA_ENTRIES + part * AREA_FAR;
        search.order_make();
        groups_search(s, substeps, shared, search, lists, part, own.number());
    }
    __syncthreads();
    if (threadIdx.x == 0 && !stopped) {
        if (shared.total > 0) atomicAdd(&s.status->contacts, (ulong)shared.total);
        uint looks = 9 * TILE_GROUPS;
        for (uint k = 0; k < TILE_GROUPS; k++) looks += shared.listed[k];
        atomicAdd(&s.status->candidates, (ulong)looks * (GROUP * GROUP));
    }
}
