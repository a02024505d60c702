// The composite stage for a regular patch of few tiles in contact with itself, by penalties: a whole frame in one launch, in which
// each block keeps a tile in shared memory from substep to substep, and the lists of groups near those of its tile.
//
// Half of the warps compute springs and move the particles, a row of the tile each; the others search for partners, those of a group
// each: while particles around the tile are on their way in the tile, then around it. The former, when they have their springs, search in
// other groups that are near, for a group each. Warps wait for those alone whose work they need, at gates (`shared/ptx.cuh`). Particles travel
// in packets that carry the number of their substep (`patch/packet.cuh`), so that nobody waits for a block whose particles it does not
// read, but for this: a block moves its particles only when all have said that their groups were within their regions and their expected
// boxes (`patch/area_expected.cuh`), and that they have read what is then written over. What was searched with lists or boxes that did not
// hold is searched once more.

// A warp for each row of the tile, and one that searches for each group.
#define WARPS (TILE_ROWS + TILE_GROUPS)

// Barriers: of the warps that compute springs, and of those that search.
#define BARRIER_SPRINGS 1
#define BARRIER_SEARCH 2

// Groups near the tile that there is room for while lists are made.
#define LISTS_NEAR (TILE_GROUPS * AREA_PAIRS / 2u)

// What the threads of a block have in shared memory beside the arrays of dynamic size.
struct Shared {
    NearFrame frame;
    // Of the groups of the tile: where partners of other groups' regions may be, and the regions they are expected to stay in.
    Box reaches[TILE_GROUPS];
    Box regions[TILE_GROUPS];
    // Groups in their lists, and near the tile when these were made.
    uint listed[TILE_GROUPS];
    uint lists_near;
    // Contact forces on the particles, row by row, and how many partners they have.
    vec3 forces[TILE_PARTICLES];
    uint contacts[TILE_PARTICLES];
    // Gates that warps open which compute springs: when the tile has moved, when what is around it has come, and when what all blocks have said is
    // known; and when what each of them has found in other groups is. One that warps open which search: when all contacts are known. Once for
    // each substep, the last three once for each search.
    ulong gate_moved;
    ulong gate_around;
    ulong gate_votes;
    ulong gates_far[TILE_GROUPS];
    ulong gate_found;
    // Groups that are near those of the tile, and partners that are in these.
    FarGroups far_groups[TILE_GROUPS];
    uint far_found[TILE_PARTICLES];
    // What warps have to say, and how many have; and what all blocks have said in two substeps in turn.
    uint vote;
    uint agreed[2];
};
// `CONTACT_STATIC` of the host.
static_assert(sizeof(Shared) <= 8704 || sizeof(real) > sizeof(float), "a block has more shared memory than the host knows of");

// Makes the lists of groups that may come near those of the tile, but for those around each. All warps that search take part, in all
// blocks; `region` is that of the group of the warp.
__device__ __forceinline__ void lists_make(
    const Solver& s, Shared& shared, const GroupPlace& tile, const Box& region, uint part, uint lane, uint number
) {
    uint4* packets = AreaPackets::regions(s);
    box_send(packets, blockIdx.x * TILE_GROUPS + part, lane, region, number);
    if (lane == 0) {
        shared.regions[part] = region;
        shared.reaches[part] = box_grown(region, contact_reach(s, region));
        shared.listed[part] = 0;
        if (part == 0) shared.lists_near = 0;
    }
    team_wait(BARRIER_SEARCH, TILE_PARTICLES);
    // What is far from all groups of the tile is not looked at by each.
    const Box& one = shared.reaches[lane % TILE_GROUPS];
    Box reach = warp_box(true, one.low, one.high);
    uint thread = part * GROUP + lane;
    real4* near = area_pairs();
    // Adds a group to the list of one of the tile, if they may come near each other and it is not around that one.
    auto add = [&](uint other, const Box& theirs, uint k) {
        if (!boxes_meet(shared.reaches[k], theirs)) return;
        GroupPlace place = GroupPlace::of(s, other), own = AreaGroup::of_tile(k).place(tile.row, tile.column);
        bool is_around = place.row + GROUP_ROWS - own.row <= 2 * GROUP_ROWS && place.column + GROUP_COLUMNS - own.column <= 2 * GROUP_COLUMNS;
        if (!is_around) area_list(s, k)[atomicAdd(&shared.listed[k], 1u)] = (unsigned short)other;
    };
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
        uint slot = atomicAdd(&shared.lists_near, 1u);
        if (slot < LISTS_NEAR) {
            near[2 * slot] = with_w(theirs.low, number_pack(other));
            near[2 * slot + 1] = with_w(theirs.high, 0);
        } else {
            for (uint k = 0; k < TILE_GROUPS; k++) add(other, theirs, k);
        }
    }
    team_wait(BARRIER_SEARCH, TILE_PARTICLES);
    for (uint pair = thread; pair < TILE_GROUPS * min(shared.lists_near, LISTS_NEAR); pair += TILE_PARTICLES) {
        real4 low = near[pair / TILE_GROUPS * 2], high = near[pair / TILE_GROUPS * 2 + 1];
        add(number_unpack(low.w), {xyz(low), xyz(high)}, pair % TILE_GROUPS);
    }
    if (blockIdx.x + thread == 0) s.status->rebuilds++;
    team_wait(BARRIER_SEARCH, TILE_PARTICLES);
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
    FarSearch far(s, tile, warp, lane);
    // Where the tile and what springs reach of its surroundings start in the area.
    const uint stencil_first = (GROUP_ROWS - HALO) * AREA_STRIDE + GROUP_COLUMNS - HALO;
    // Sends the particle of the thread.
    auto send = [&](const AreaPackets& packets, const vec3& position, const vec3& velocity) {
        if (own.exists) {
            packet_send(packets.positions + own.i, position, packets.number);
            packet_send(packets.velocities + own.i, velocity, packets.number);
        }
    };
    // Whether it has stayed where it was expected, and within numbers that are finite. Sends what the block has to say of that when all its rows
    // have come here.
    bool stays = true, finite = true;
    auto vote = [&](const AreaPackets& packets) {
        bool is_stale = __any_sync(ALL_LANES, !stays), stops = __any_sync(ALL_LANES, !finite);
        if (lane != 0) return;
        uint said = 1 + (is_stale ? 1u << 8 : 0) + (stops ? 1u << 16 : 0);
        uint all = said + atomicAdd(&shared.vote, said);
        if ((all & 255u) < TILE_ROWS) return;
        shared.vote = 0;
        pair_store(packets.votes + blockIdx.x, (all >> 8 & 255u ? VOTE_STALE : 0) | (all >> 16 ? VOTE_STOP : 0), packets.number);
    };
    send(AreaPackets::of(s, (uint)s.epoch + 1), xyz(x[own.at]), xyz(v[own.at]));
    vote(AreaPackets::of(s, (uint)s.epoch + 1));
    gate_arrive(&shared.gate_moved);
    uint searches_before = 0;
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
            vote(packets);
#pragma unroll
            for (uint which = 0; which < 2; which++) {
                if (!takes[which]) continue;
                vec3 position, velocity;
                packets.particle_wait(numbers[which], coming[which], position, velocity);
                x[entries[which]] = with_w(position, 0);
                v[entries[which]] = with_w(velocity, 0);
            }
        }
        gate_arrive(&shared.gate_around);
        team_wait(BARRIER_SPRINGS, TILE_PARTICLES);
        // What others have said, and what comes next, are on their way while springs are computed.
        // Lanes that are left over look at the last one.
        uint block = warp * 32;
        ulong voted, told;
        if (block < gridDim.x) pair_load(packets.votes + min(block + lane, gridDim.x - 1), voted, told);
        bool reads_ahead = warp == TILE_ROWS - 1;
        if (reads_ahead) shared.frame.follow<true>(s, number, substeps, lane, 32);
        const SubstepData& substep = shared.frame.of(number);
        // Where the particle is, and the force on it; its own springs come back from shared memory, as a search comes between.
        vec3 xi, vi, force, springs[STENCIL_KINDS];
        stencil_springs<AREA_STRIDE>(s, x + stencil_first, v + stencil_first, own.row, own.column, outer, forces, springs);
        const FarGroups& groups = shared.far_groups[warp];
        bool searches = far.begin(s, packets, groups, searches_before);
        uint said = 0;
        // Where lists did not hold all is searched once more.
#pragma unroll 1
        for (bool again = false;; again = true) {
            if (searches) {
                far.search(s, packets, groups);
                shared.far_found[far.number(lane)] = far.found;
            }
            gate_arrive(&shared.gates_far[warp]);
            if (!again) {
                team_wait(BARRIER_SPRINGS, TILE_PARTICLES);
                xi = xyz(x[own.at]), vi = xyz(v[own.at]);
                force = field_force(s, mass, vi);
                force = procedural_force(substep, own.i, xi, vi, mass, force);
                if (inside) {
                    force = stencil_sum<true, false>(forces, own.row, own.column, 0, nullptr, force);
                } else {
                    force = stencil_sum<false, false>(forces, own.row, own.column, mask, nullptr, force);
                }
            }
#pragma unroll 1
            for (; block < gridDim.x; block += TILE_PARTICLES) {
                while ((uint)told != packets.number) pair_load(packets.votes + min(block + lane, gridDim.x - 1), voted, told);
                if (voted != 0) atomicOr(&shared.agreed[number & 1], (uint)voted);
                told = packets.number - 1;
            }
            __syncwarp();
            if (reads_ahead && !again) copies_wait();
            gate_arrive(&shared.gate_votes);
            gate_wait(&shared.gate_votes, searches_before);
            gate_wait(&shared.gate_found, searches_before);
            searches_before++;
            said = agreed(shared, number);
            if (again || said != VOTE_STALE) break;
            searches = far.begin(s, packets, groups, searches_before);
        }
        if (threadIdx.x == 0) shared.agreed[(number + 1) & 1] = 0;
        if (said & VOTE_STOP) return true;
        uint contacts = shared.contacts[own.number()];
        if (contacts > 0) force = force + shared.forces[own.number()];
        Moved moved = integrate(substep.length, inverse_mass, force, xi, vi);
        if (own.exists && inverse_mass > 0) shared.frame.collide(s, number, own.i, offset, inverse_mass, xi, moved);
        finite = !own.exists || is_finite(moved.position) && is_finite(moved.velocity);
        if (!finite) atomicMin(&s.status->non_finite_step, substep.step);
        if (own.exists) {
            x[own.at] = with_w(moved.position, inverse_mass);
            v[own.at] = with_w(moved.velocity, mass);
        }
        if (number + 1 == substeps) break;
        gate_arrive(&shared.gate_moved);
        // Written so that what is not a number is not within.
        bool is_within = box_holds(shared.regions[own.part()], moved.position) && expected_holds(s, expected_place(substep, xi, vi), moved.position);
        stays = !own.exists || is_within;
        send(AreaPackets::of(s, packets.number + 1), moved.position, moved.velocity);
    }
    return false;
}

// The group of the tile that such a warp searches for. Every fourth warp has the same scheduler: those of two groups one above the other, which
// crumple together, have different ones.
__device__ __forceinline__ uint group_of_warp(uint warp) { return warp < 4 ? warp : 4 + (warp + 2) % 4; }

// Adds what a group has in contact and what it looked at to the counts of the frame.
__device__ __forceinline__ void group_count(const Solver& s, uint lane, uint contacts, uint listed) {
    uint total = (uint)__reduce_add_sync(ALL_LANES, (int)contacts);
    if (lane != 0) return;
    if (total > 0) atomicAdd(&s.status->contacts, (ulong)total);
    atomicAdd(&s.status->candidates, (ulong)(9 + listed) * (GROUP * GROUP));
}

// What a warp that searches does in a frame.
__device__ __forceinline__ void groups_search(const Solver& s, uint substeps, Shared& shared, AreaSearch& search) {
    uint lane = search.lane, part = search.part, group = blockIdx.x * TILE_GROUPS + part, searches_before = 0, listed = 0;
    ListedGroup other;
#pragma unroll 1
    for (uint number = 0; number < substeps; number++) {
        AreaPackets packets = AreaPackets::of(s, (uint)s.epoch + number + 1);
        // The lists are made at the start of a frame, and where they turn out not to hold.
        bool holds = number > 0, again = false;
        while (true) {
            if (!holds) {
                // Boxes are on their way to all while lists are made.
                packets.is_exact = true;
                packets.group_send(group, lane, search.look(s));
                Box region = region_of(s, search.exists, xyz(area_x()[search.at]), xyz(area_v()[search.at]));
                lists_make(s, shared, search.tile, region, part, lane, packets.number);
            }
            if (!again) gate_wait(&shared.gate_moved, number);
            search.start(s);
            if (!holds) {
                listed = shared.listed[part];
                other.find(s, search, 0, listed);
                packets.box_ask(other.group, other.box);
            }
            vec3 place = expected_place(shared.frame.of(number), xyz(area_x()[search.at]), xyz(area_v()[search.at]));
            // First what is in the tile, then what is around it.
#pragma unroll 1
            for (uint around = 0; around < 2; around++) {
                if (around && !again) gate_wait(&shared.gate_around, number);
                search.take_around(s, !around);
                if (!around) shared.far_groups[part].fill(s, search, packets, listed, other);
                // But for each with itself.
                search.compare(around ? 0 : 1u << lane);
            }
            uint groups = shared.far_groups[part].count, far = groups > AREA_FAR_GROUPS ? NONE : 0;
            if (groups > 0 && groups <= AREA_FAR_GROUPS) {
                gate_wait(&shared.gates_far[part], searches_before);
                far = shared.far_found[search.number(lane)];
            }
            // Of too many groups nobody has looked at any.
            uint found = far == NONE ? 1 : search.found + far;
            ContactSum sum = {{0, 0, 0}, 0};
            if (__any_sync(ALL_LANES, found > 0)) {
                bool has_room = !__any_sync(ALL_LANES, search.found > AREA_PARTNERS_HERE || far > AREA_PARTNERS_FAR);
                if (has_room && !__any_sync(ALL_LANES, found > PARTNERS_FEW)) {
                    sum = contacts_sum_few(s, search, packets, search.found, far);
                } else {
                    uint total, start = lanes_before(found, lane, total);
                    if (has_room && total <= AREA_PAIRS) {
                        sum = contacts_sum(s, search, packets, search.found, far, start, total);
                    } else {
                        sum = contacts_sum_many(s, search, packets, shared.listed[part]);
                    }
                }
            }
            uint particle = search.number(lane);
            shared.contacts[particle] = sum.contacts;
            if (sum.contacts > 0) shared.forces[particle] = sum.force;
            gate_arrive(&shared.gate_found);
            Box expected = expected_box(s, search.exists, place);
            gate_wait(&shared.gate_votes, searches_before);
            searches_before++;
            uint all = agreed(shared, number);
            if (all & VOTE_STOP) return;
            if (again || all != VOTE_STALE) {
                if (number + 1 == substeps) {
                    group_count(s, lane, sum.contacts, listed);
                    break;
                }
                // All have read the boxes that these take the place of.
                AreaPackets next = AreaPackets::of(s, packets.number + 1);
                next.group_send(group, lane, expected);
                next.box_ask(other.group, other.box);
                break;
            }
            again = true;
            holds = false;
        }
    }
}

extern "C" __global__ void __launch_bounds__(WARPS * 32, 1) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    __shared__ Shared shared;
    real4* x = area_x();
    real4* v = area_v();
    uint across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
    GroupPlace tile = {blockIdx.x / across * TILE_ROWS, blockIdx.x % across * TILE_COLUMNS};
    ulong broken = *(volatile ulong*)&s.status->non_finite_step;
    uint lane = threadIdx.x & 31, warp = threadIdx.x / 32;
    if (warp == WARPS - 1) shared.frame.start(s, substeps, lane, 32);
    // What is not there is in nobody's reach.
    rectangle_start<AREA_ENTRIES, AREA_STRIDE, WARPS * 32>(s, present_motion(s), tile.row - GROUP_ROWS, tile.column - GROUP_COLUMNS, REAL_MAX, x, v);
    if (warp == WARPS - 1) {
        if (lane < TILE_GROUPS) {
            gate_make(&shared.far_groups[lane].gate, GROUP);
            gate_make(&shared.gates_far[lane], GROUP);
        }
        if (lane == 0) {
            shared.vote = shared.agreed[0] = shared.agreed[1] = 0;
            gate_make(&shared.gate_moved, TILE_PARTICLES);
            gate_make(&shared.gate_around, TILE_PARTICLES);
            gate_make(&shared.gate_votes, TILE_PARTICLES);
            gate_make(&shared.gate_found, TILE_PARTICLES);
        }
    }
    copies_wait();
    __syncthreads();
    bool stopped = broken < shared.frame.of(0).step;
    if (warp < TILE_ROWS) {
        if (!stopped) stopped = rows_advance(s, substeps, shared, tile, x, v, area_forces());
        Own own = Own::of(s, tile, warp, lane);
        if (own.exists) {
            s.position[state_after(s, substeps)][own.i] = x[own.at];
            s.velocity[state_after(s, substeps)][own.i] = v[own.at];
        }
    } else if (!stopped) {
        AreaSearch search(s, tile, group_of_warp(warp - TILE_ROWS), lane);
        groups_search(s, substeps, shared, search);
    }
}
