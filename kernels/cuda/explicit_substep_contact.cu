// The composite stage for a regular patch of few tiles in contact with itself, by penalties: a whole frame in one launch, in which
// each block keeps a tile in shared memory from substep to substep, and the lists of groups near those of its tile.
//
// Half of the warps compute springs and move the particles, a row of the tile each; the others search for partners, those of a group
// each: while particles around the tile are on their way in the tile, then around it, then in other groups that are near. Particles
// travel in packets that carry the number of their substep (`shared/packet.cuh`), so that nobody waits for a block whose particles it
// does not read, but for this: a block moves its particles only when all have said that their groups were within their regions, and
// that they have read what is then written over. What was searched with lists that did not hold is searched once more.

extern __shared__ __align__(16) unsigned char frame_memory[];

#define TILE_GROUPS (TILE_COLUMNS * TILE_ROWS / GROUP)
#define TILE_PARTICLES (TILE_COLUMNS * TILE_ROWS)
#define GROUP_COLUMNS 8
#define GROUP_ROWS 4
// A warp for each row of the tile, and one that searches for each group.
#define WARPS (TILE_ROWS + TILE_GROUPS)

// The tile and a group around it on all sides.
#define AREA_STRIDE (TILE_COLUMNS + 2 * GROUP_COLUMNS)
#define AREA_ENTRIES (AREA_STRIDE * (TILE_ROWS + 2 * GROUP_ROWS))
// Particles that a group is compared with at once, or pairs of it in contact; particles from elsewhere that are kept, and partners of
// one particle.
#define MEMBERS (8 * GROUP)
#define FAR 96
#define PARTNERS 24
// In place of an entry, for what there is no room for.
#define IN_PACKETS 0xffffu
// Groups that a warp looks at together, so that it does not wait for each.
#define TOGETHER 1

// Barriers: of the warps that compute springs, and of those that search; those at which the former tell the latter that the tile has
// moved, and that what is around it is there; and that of all, where a substep is known but for what it does to the particles.
#define BARRIER_SPRINGS 1
#define BARRIER_SEARCH 2
#define BARRIER_MOVED 3
#define BARRIER_AROUND 4
#define BARRIER_FORCES 5

// a b + c, rounded once.
__device__ __forceinline__ real multiply_add(real a, real b, real c) {
#ifdef CLOTH_F64
    return fma(a, b, c);
#else
    return __fmaf_rn(a, b, c);
#endif
}

// What is sent in one substep.
struct Packets {
    uint4* positions;
    uint4* velocities;
    // Two for each group.
    uint4* boxes;
    // One for each block.
    uint4* votes;
    uint number;

    __device__ __forceinline__ static uint size(const Solver& s) { return 2 * s.count + 2 * s.group_count + gridDim.x; }

    __device__ __forceinline__ static Packets of(const Solver& s, uint number) {
        uint4* first = s.packets + (number & 1) * size(s);
        return {first, first + s.count, first + 2 * s.count, first + 2 * s.count + 2 * s.group_count, number};
    }

    // Those of the regions of groups, of any substep.
    __device__ __forceinline__ static uint4* regions(const Solver& s) { return s.packets + 2 * size(s); }

    __device__ __forceinline__ void particle_ask(uint i, Coming& coming) const { coming.ask(positions + i, velocities + i); }
    __device__ __forceinline__ void particle_wait(uint i, Coming& coming, vec3& position, vec3& velocity) const {
        coming.wait(positions + i, velocities + i, number, position, velocity);
    }
    __device__ __forceinline__ void particle_wait(uint i, vec3& position, vec3& velocity) const {
        packets_wait(positions + i, velocities + i, number, position, velocity);
    }
};

// By the lanes of a warp together.
__device__ __forceinline__ void box_send(uint4* boxes, uint group, uint lane, const Box& box, uint number) {
    if (lane < 2) packet_send(boxes + 2 * group + lane, lane == 0 ? box.low : box.high, number);
}

// A group of the patch: its first row and column, and its particle of a lane.
struct Place {
    uint row;
    uint column;

    __device__ __forceinline__ static Place of(const Solver& s, uint group) {
        uint across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
        uint tile = group / TILE_GROUPS, part = group % TILE_GROUPS;
        return {tile / across * TILE_ROWS + part / 4 * GROUP_ROWS, tile % across * TILE_COLUMNS + part % 4 * GROUP_COLUMNS};
    }
    __device__ __forceinline__ bool has(const Solver& s, uint lane) const {
        return row + lane / GROUP_COLUMNS < s.rows && column + lane % GROUP_COLUMNS < s.columns;
    }
    __device__ __forceinline__ uint particle(const Solver& s, uint lane) const {
        return (row + lane / GROUP_COLUMNS) * s.columns + column + lane % GROUP_COLUMNS;
    }
};

// A group of the area by its row and column among these: those of the tile are in rows 1 and 2 and columns 1 to 4.
struct AreaGroup {
    uint row;
    uint column;

    // Group number `part` of the tile.
    __device__ __forceinline__ static AreaGroup of_tile(uint part) { return {part / 4 + 1, part % 4 + 1}; }
    // Two around the tile for each of eight warps.
    __device__ __forceinline__ static AreaGroup around(uint warp, uint which) {
        uint column = warp % 4, half = warp / 4;
        if (which == 0) return {half * 3, column + 1};
        bool is_beside = column == 0 || column == 3;
        return {is_beside ? half + 1 : half * 3, column < 2 ? 0u : 5u};
    }
    // Number `which` of those around a group of the tile, row by row.
    __device__ __forceinline__ AreaGroup next_to(uint which) const { return {row + which / 3 - 1, column + which % 3 - 1}; }
    __device__ __forceinline__ bool is_of_tile() const { return row - 1 < 2 && column - 1 < 4; }
    __device__ __forceinline__ Place place(uint first_row, uint first_column) const {
        return {first_row + (row - 1) * GROUP_ROWS, first_column + (column - 1) * GROUP_COLUMNS};
    }
    // The entry of its particle of a lane.
    __device__ __forceinline__ uint entry(uint lane) const {
        return (row * GROUP_ROWS + lane / GROUP_COLUMNS) * AREA_STRIDE + column * GROUP_COLUMNS + lane % GROUP_COLUMNS;
    }
};

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

// The forces of the partners of a particle, and how many these are.
struct ContactSum {
    vec3 force;
    uint contacts;
};

// A warp that searches for the partners of a group of the tile.
struct Search {
    // Particles: those of the area, then others that are kept.
    real4* x;
    real4* v;
    // What is to be compared: particles as seen from the middle of the group, with the squares of their distances from there; and
    // what they are called, number above and entry below.
    real4* members;
    uint* keys;
    // Of the particle of the lane, so named and in no order.
    uint* partners;
    const unsigned short* list;
    Place tile;
    AreaGroup group;
    uint lane;
    uint at;
    bool exists;
    // Groups around it, four bits each, those of the tile first, and how many these are.
    uint order;
    uint order_in_tile;
    // First entry of particles that are kept for the group.
    uint far_first;

    // Of a substep. In |x|² - 2 x·y + |y|², seen from the middle of the group, three operations for each pair tell those that are too
    // far apart. Nobody needs its bits: `most` is larger than the square of the contact distance by more than rounding can take away, and
    // what is left is looked at as the results need it.
    vec3 own;
    Box reach;
    vec3 middle;
    vec3 minus_twice;
    real most;
    // How many are to be compared, how many are kept, and how many partners there are.
    uint count;
    uint far;
    uint found;

    __device__ __forceinline__ void order_make() {
        uint added = 0;
        order = order_in_tile = 0;
#pragma unroll 1
        for (uint k = 0; k < 18; k++) {
            uint which = k % 9;
            if (which == 4 || group.next_to(which).is_of_tile() != k < 9) continue;
            order |= which << 4 * added;
            added++;
            if (k < 9) order_in_tile++;
        }
    }

    // The substep begins: gives the box of the group, which is compared with itself first.
    __device__ __forceinline__ Box start(const Solver& s) {
        own = xyz(x[at]);
        Box box = warp_box(exists, own, own);
        reach = box_grown(box, contact_reach(s, box));
        middle = (real)0.5 * (box.low + box.high);
        vec3 corner = reach.high - middle, seen = own - middle;
        real squared = dot(seen, seen);
        minus_twice = (real)-2 * seen;
        most = (real)1.001 * s.contact_distance * s.contact_distance + (real)128 * REAL_EPSILON * dot(corner, corner) - squared;
        far = found = 0;
        uint present = __ballot_sync(ALL_LANES, exists);
        count = __popc(present);
        uint slot = __popc(present & ((1u << lane) - 1));
        if (exists) {
            members[slot] = with_w(seen, squared);
            keys[slot] = group.place(tile.row, tile.column).particle(s, lane) << 16 | at;
        }
        return box;
    }

    // Those of a group that are in reach are to be compared.
    __device__ __forceinline__ void take(uint inside, const vec3& theirs, uint number, uint entry) {
        uint slot = count + __popc(inside & ((1u << lane) - 1));
        if (inside >> lane & 1) {
            vec3 seen = theirs - middle;
            members[slot] = with_w(seen, dot(seen, seen));
            keys[slot] = number << 16 | entry;
        }
        count += __popc(inside);
    }

    // Takes those around the group from number `first` of the order on. At most five are in the tile, as are at most five not: there is
    // room for them and the group.
    __device__ __forceinline__ void take_around(const Solver& s, uint first, uint end) {
#pragma unroll 1
        for (; first < end; first += TOGETHER) {
            vec3 theirs[TOGETHER];
            uint entries[TOGETHER], numbers[TOGETHER], inside[TOGETHER];
#pragma unroll
            for (uint k = 0; k < TOGETHER; k++) {
                AreaGroup other = group.next_to(order >> 4 * (first + k) & 15u);
                Place place = other.place(tile.row, tile.column);
                bool is_there = first + k < end && place.has(s, lane);
                entries[k] = is_there ? other.entry(lane) : at;
                numbers[k] = place.particle(s, lane);
                theirs[k] = xyz(x[entries[k]]);
                inside[k] = __ballot_sync(ALL_LANES, is_there && box_holds(reach, theirs[k]));
            }
#pragma unroll
            for (uint k = 0; k < TOGETHER; k++) take(inside[k], theirs[k], numbers[k], entries[k]);
        }
    }

    // Compares what there is to be compared: what may be in contact are partners for the time being.
    __device__ __forceinline__ void compare() {
        __syncwarp();
#pragma unroll 1
        for (uint first = 0; first < count; first += 32) {
            const real4* those = members + first;
            uint left = count - first, hits = 0;
#pragma unroll 1
            for (uint done = 0; done < min(left, 32u); done += 8) {
                uint eight = 0;
#pragma unroll
                for (uint k = 0; k < 8; k++) {
                    real4 member = those[done + k];
                    real difference = multiply_add(minus_twice.x, member.x, multiply_add(minus_twice.y, member.y, multiply_add(minus_twice.z, member.z, member.w)));
                    // Written so that what is not a number may meet.
                    eight |= difference >= most ? 0 : 1u << k;
                }
                hits |= eight << done;
            }
            if (left < 32) hits &= (1u << left) - 1;
            if (!exists) hits = 0;
            for (; hits != 0; hits &= hits - 1) {
                uint key = keys[first + __ffs(hits) - 1];
                if ((key & IN_PACKETS) == at) continue;
                if (found < PARTNERS) partners[found * TILE_PARTICLES] = key;
                found++;
            }
        }
        __syncwarp();
        count = 0;
    }

    // The group of the list that is that of the lane, from number `first` on.
    __device__ __forceinline__ uint listed_group(uint first, uint listed) const { return first + lane < listed ? list[first + lane] : NONE; }

    // Which of 32 groups of the list are near, one for each lane, whose box is on its way.
    __device__ __forceinline__ uint near_groups(const Packets& packets, uint other, Coming& coming) const {
        bool meets = false;
        if (other != NONE) {
            Box box;
            coming.wait(packets.boxes + 2 * other, packets.boxes + 2 * other + 1, packets.number, box.low, box.high);
            meets = boxes_meet(reach, box);
        }
        return __ballot_sync(ALL_LANES, meets);
    }

    // Compares with those of groups of the list, one for each lane, that are near, while others are on their way.
    __device__ __forceinline__ void find_far(const Solver& s, const Packets& packets, uint other, uint near) {
        Place places[TOGETHER];
        Coming coming[TOGETHER];
        auto ask = [&] {
#pragma unroll
            for (uint k = 0; k < TOGETHER; k++) {
                places[k] = {s.rows, s.columns};
                if (near == 0) continue;
                places[k] = Place::of(s, __shfl_sync(ALL_LANES, other, __ffs(near) - 1));
                near &= near - 1;
                if (places[k].has(s, lane)) packets.particle_ask(places[k].particle(s, lane), coming[k]);
            }
        };
        ask();
#pragma unroll 1
        while (places[0].row < s.rows) {
#pragma unroll
            for (uint k = 0; k < TOGETHER; k++) {
                bool is_there = places[k].has(s, lane);
                uint number = places[k].particle(s, lane);
                vec3 theirs = {0, 0, 0}, velocity;
                if (is_there) packets.particle_wait(number, coming[k], theirs, velocity);
                uint inside = __ballot_sync(ALL_LANES, is_there && box_holds(reach, theirs));
                uint slot = far + __popc(inside & ((1u << lane) - 1)), entry = IN_PACKETS;
                far += __popc(inside);
                if (slot < FAR && inside >> lane & 1) {
                    entry = far_first + slot;
                    x[entry] = with_w(theirs, 0);
                    v[entry] = with_w(velocity, 0);
                }
                take(inside, theirs, number, entry);
            }
            ask();
            compare();
        }
    }

    // Looks at the partners of all particles of the group, and sums the forces of those in contact, ascending for each. A lane takes any
    // of the pairs, so that few wait for the particle with the most. `start` is how many pairs lanes before have, `total` how many
    // there are.
    __device__ __forceinline__ ContactSum sum(const Solver& s, const Packets& packets, uint start, uint total) const {
#pragma unroll 1
        for (uint first = 0; first < total; first += 32) {
            uint number = first + lane, owner = 0;
#pragma unroll
            for (uint step = 16; step > 0; step /= 2) {
                if (__shfl_sync(ALL_LANES, start, owner + step) <= number) owner += step;
            }
            uint owner_start = __shfl_sync(ALL_LANES, start, owner), owner_found = __shfl_sync(ALL_LANES, found, owner);
            uint owner_at = __shfl_sync(ALL_LANES, at, owner);
            if (number >= total) continue;
            const uint* keys_of_owner = partners + (lane_place(owner) - lane_place(lane));
            uint key = keys_of_owner[(number - owner_start) * TILE_PARTICLES], place = owner_start;
            for (uint k = 0; k < owner_found; k++) place += keys_of_owner[k * TILE_PARTICLES] < key;
            uint entry = key & IN_PACKETS;
            vec3 xj, vj, force = {0, 0, 0};
            if (entry == IN_PACKETS) {
                packets.particle_wait(key >> 16, xj, vj);
            } else {
                xj = xyz(x[entry]);
                vj = xyz(v[entry]);
            }
            Pair pair = pair_of(xyz(x[owner_at]), xj);
            bool touches = is_in_contact(s, pair.length_squared);
            if (touches) penalty_add(s, pair, xyz(v[owner_at]) - vj, force);
            members[place] = with_w(force, touches ? 1 : 0);
        }
        __syncwarp();
        ContactSum sum = {{0, 0, 0}, 0};
        for (uint k = 0; k < found; k++) {
            real4 member = members[start + k];
            // A sum is never -0, so that it stays as it is where there is no contact.
            sum.force = sum.force + xyz(member);
            sum.contacts += member.w > 0 ? 1 : 0;
        }
        __syncwarp();
        return sum;
    }

    // How far the particle of a lane is from the first of the group in the tile.
    __device__ __forceinline__ static int lane_place(uint lane) { return (int)(lane / GROUP_COLUMNS * TILE_COLUMNS + lane % GROUP_COLUMNS); }

    // The same where there was no room for all: so many at a time as fit, from the lowest on. By value, as who is called may change
    // what it has the address of.
    __device__ __noinline__ static ContactSum sum_many(const Solver& s, Search search, Packets packets, uint listed) {
        uint lane = search.lane, i = search.group.place(search.tile.row, search.tile.column).particle(s, lane), from = 0;
        vec3 velocity = xyz(search.v[search.at]);
        uint* kept = search.partners;
        bool more = true;
        ContactSum sum = {{0, 0, 0}, 0};
        while (__any_sync(ALL_LANES, more)) {
            uint found = 0;
            more = false;
            auto look = [&](const Place& there) {
                bool is_there = there.has(s, lane);
                vec3 position = {0, 0, 0}, theirs;
                if (is_there) packets.particle_wait(there.particle(s, lane), position, theirs);
                for (uint present = __ballot_sync(ALL_LANES, is_there); present != 0; present &= present - 1) {
                    uint member = __ffs(present) - 1, j = there.particle(s, member);
                    vec3 xj = {__shfl_sync(ALL_LANES, position.x, member), __shfl_sync(ALL_LANES, position.y, member), __shfl_sync(ALL_LANES, position.z, member)};
                    if (!search.exists || j < from || j == i || !is_in_contact(s, pair_of(search.own, xj).length_squared)) continue;
                    // The highest gives way.
                    more |= found == PARTNERS;
                    if (found == PARTNERS && kept[(PARTNERS - 1) * TILE_PARTICLES] < j) continue;
                    uint place = min(found, PARTNERS - 1);
                    for (; place > 0 && kept[(place - 1) * TILE_PARTICLES] > j; place--) kept[place * TILE_PARTICLES] = kept[(place - 1) * TILE_PARTICLES];
                    kept[place * TILE_PARTICLES] = j;
                    found = min(found + 1, PARTNERS);
                }
            };
            for (uint which = 0; which < 9; which++) look(search.group.next_to(which).place(search.tile.row, search.tile.column));
            for (uint first = 0; first < listed; first += 32) {
                uint other = search.listed_group(first, listed);
                Coming coming;
                if (other != NONE) coming.ask(packets.boxes + 2 * other, packets.boxes + 2 * other + 1);
                for (uint near = search.near_groups(packets, other, coming); near != 0; near &= near - 1) {
                    look(Place::of(s, __shfl_sync(ALL_LANES, other, __ffs(near) - 1)));
                }
            }
            for (uint k = 0; k < found; k++) {
                uint j = kept[k * TILE_PARTICLES];
                vec3 xj, vj;
                packets.particle_wait(j, xj, vj);
                penalty_add(s, pair_of(search.own, xj), velocity - vj, sum.force);
                from = j + 1;
            }
            sum.contacts += found;
        }
        return sum;
    }
};

// Makes the lists of groups that may come near those of the tile, but for those around each. All warps that search take part, in all
// blocks; `region` is that of the group of the warp.
__device__ __forceinline__ void lists_make(
    const Solver& s, Shared& shared, unsigned short* lists, const Place& tile, const Box& region, uint part, uint lane, uint number
) {
    uint4* packets = Packets::regions(s);
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
        Place place = Place::of(s, other);
#pragma unroll 1
        for (uint k = 0; k < TILE_GROUPS; k++) {
            if (!boxes_meet(shared.reaches[k], theirs)) continue;
            Place own = AreaGroup::of_tile(k).place(tile.row, tile.column);
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

    __device__ __forceinline__ static Own of(const Solver& s, const Place& tile, uint row, uint column) {
        uint r = tile.row + row, c = tile.column + column;
        return {row, column, r * s.columns + c, (row + GROUP_ROWS) * AREA_STRIDE + column + GROUP_COLUMNS, r < s.rows && c < s.columns};
    }
    // Its number, row by row.
    __device__ __forceinline__ uint number() const { return row * TILE_COLUMNS + column; }
    // The group of the tile that it is in.
    __device__ __forceinline__ uint part() const { return row / GROUP_ROWS * 4 + column / GROUP_COLUMNS; }
};

// What a warp that computes springs does in a frame. Says whether it was stopped.
__device__ __forceinline__ bool rows_advance(const Solver& s, uint substeps, Shared& shared, const Place& tile, real4* x, real4* v, real* forces) {
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
    auto send = [&](const Packets& packets, const vec3& position, const vec3& velocity, bool stays, bool finite) {
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
    send(Packets::of(s, (uint)s.epoch + 1), xyz(x[own.at]), xyz(v[own.at]), true, true);
#pragma unroll 1
    for (uint number = 0; number < substeps; number++) {
        Packets packets = Packets::of(s, (uint)s.epoch + number + 1);
        if (number > 0) {
            Coming coming[2];
            uint entries[2], numbers[2];
            bool takes[2];
#pragma unroll
            for (uint which = 0; which < 2; which++) {
                AreaGroup around = AreaGroup::around(warp, which);
                Place there = around.place(tile.row, tile.column);
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
        send(Packets::of(s, packets.number + 1), moved.position, moved.velocity, stays, finite);
    }
    return false;
}

// What a warp that searches does in a frame.
__device__ __forceinline__ void groups_search(const Solver& s, uint substeps, Shared& shared, Search& search, unsigned short* lists, uint part, uint particle) {
    uint lane = search.lane;
    bool reads_ahead = part == TILE_GROUPS - 1;
#pragma unroll 1
    for (uint number = 0; number < substeps; number++) {
        Packets packets = Packets::of(s, (uint)s.epoch + number + 1);
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
                if (__any_sync(ALL_LANES, search.found > PARTNERS) || total > MEMBERS) {
                    sum = Search::sum_many(s, search, packets, listed);
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
    const uint kept_entries = AREA_ENTRIES + TILE_GROUPS * FAR;
    real4* x = (real4*)frame_memory;
    real4* v = x + kept_entries;
    real4* members = v + kept_entries;
    uint* keys = (uint*)(members + TILE_GROUPS * MEMBERS);
    uint* partners = keys + TILE_GROUPS * MEMBERS;
    real* forces = (real*)(partners + PARTNERS * TILE_PARTICLES);
    unsigned short* lists = (unsigned short*)(forces + 3 * STENCIL_FORCES);
    uint across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
    Place tile = {blockIdx.x / across * TILE_ROWS, blockIdx.x % across * TILE_COLUMNS};
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
        Search search;
        search.x = x;
        search.v = v;
        search.members = members + part * MEMBERS;
        search.keys = keys + part * MEMBERS;
        search.partners = partners + own.number();
        search.list = lists + part * s.group_count;
        search.tile = tile;
        search.group = AreaGroup::of_tile(part);
        search.lane = lane;
        search.at = own.at;
        search.exists = own.exists;
        search.far_first = AREA_ENTRIES + part * FAR;
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
