// How a warp searches for the partners of a group of the tile: what is in reach is put together, from the area and from other groups
// that are near, and compared at once; then the forces of those in contact are summed as the results need it.

// Particles that a group is compared with at once, or pairs of it in contact; particles from elsewhere that are kept, and partners of
// one particle.
#define AREA_MEMBERS (8 * GROUP)
#define AREA_FAR 96
#define AREA_PARTNERS 24
// In place of an entry, for what there is no room for.
#define AREA_IN_PACKETS 0xffffu
// Groups that a warp looks at together, so that it does not wait for each.
#define AREA_TOGETHER 1

// The forces of the partners of a particle, and how many these are.
struct ContactSum {
    vec3 force;
    uint contacts;
};

// A warp that searches for the partners of a group of the tile.
struct AreaSearch {
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
    GroupPlace tile;
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
        for (; first < end; first += AREA_TOGETHER) {
            vec3 theirs[AREA_TOGETHER];
            uint entries[AREA_TOGETHER], numbers[AREA_TOGETHER], inside[AREA_TOGETHER];
#pragma unroll
            for (uint k = 0; k < AREA_TOGETHER; k++) {
                AreaGroup other = group.next_to(order >> 4 * (first + k) & 15u);
                GroupPlace place = other.place(tile.row, tile.column);
                bool is_there = first + k < end && place.has(s, lane);
                entries[k] = is_there ? other.entry(lane) : at;
                numbers[k] = place.particle(s, lane);
                theirs[k] = xyz(x[entries[k]]);
                inside[k] = __ballot_sync(ALL_LANES, is_there && box_holds(reach, theirs[k]));
            }
#pragma unroll
            for (uint k = 0; k < AREA_TOGETHER; k++) take(inside[k], theirs[k], numbers[k], entries[k]);
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
                    real difference = fma(minus_twice.x, member.x, fma(minus_twice.y, member.y, fma(minus_twice.z, member.z, member.w)));
                    // Written so that what is not a number may meet.
                    eight |= difference >= most ? 0 : 1u << k;
                }
                hits |= eight << done;
            }
            if (left < 32) hits &= (1u << left) - 1;
            if (!exists) hits = 0;
            for (; hits != 0; hits &= hits - 1) {
                uint key = keys[first + __ffs(hits) - 1];
                if ((key & AREA_IN_PACKETS) == at) continue;
                if (found < AREA_PARTNERS) partners[found * TILE_PARTICLES] = key;
                found++;
            }
        }
        __syncwarp();
        count = 0;
    }

    // The group of the list that is that of the lane, from number `first` on.
    __device__ __forceinline__ uint listed_group(uint first, uint listed) const { return first + lane < listed ? list[first + lane] : NONE; }

    // Which of 32 groups of the list are near, one for each lane, whose box is on its way.
    __device__ __forceinline__ uint near_groups(const AreaPackets& packets, uint other, Coming& coming) const {
        bool meets = false;
        if (other != NONE) {
            Box box;
            coming.wait(packets.boxes + 2 * other, packets.boxes + 2 * other + 1, packets.number, box.low, box.high);
            meets = boxes_meet(reach, box);
        }
        return __ballot_sync(ALL_LANES, meets);
    }

    // Compares with those of groups of the list, one for each lane, that are near, while others are on their way.
    __device__ __forceinline__ void find_far(const Solver& s, const AreaPackets& packets, uint other, uint near) {
        GroupPlace places[AREA_TOGETHER];
        Coming coming[AREA_TOGETHER];
        auto ask = [&] {
#pragma unroll
            for (uint k = 0; k < AREA_TOGETHER; k++) {
                places[k] = {s.rows, s.columns};
                if (near == 0) continue;
                places[k] = GroupPlace::of(s, __shfl_sync(ALL_LANES, other, __ffs(near) - 1));
                near &= near - 1;
                if (places[k].has(s, lane)) packets.particle_ask(places[k].particle(s, lane), coming[k]);
            }
        };
        ask();
#pragma unroll 1
        while (places[0].row < s.rows) {
#pragma unroll
            for (uint k = 0; k < AREA_TOGETHER; k++) {
                bool is_there = places[k].has(s, lane);
                uint number = places[k].particle(s, lane);
                vec3 theirs = {0, 0, 0}, velocity;
                if (is_there) packets.particle_wait(number, coming[k], theirs, velocity);
                uint inside = __ballot_sync(ALL_LANES, is_there && box_holds(reach, theirs));
                uint slot = far + __popc(inside & ((1u << lane) - 1)), entry = AREA_IN_PACKETS;
                far += __popc(inside);
                if (slot < AREA_FAR && inside >> lane & 1) {
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
    __device__ __forceinline__ ContactSum sum(const Solver& s, const AreaPackets& packets, uint start, uint total) const {
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
            uint entry = key & AREA_IN_PACKETS;
            vec3 xj, vj, force = {0, 0, 0};
            if (entry == AREA_IN_PACKETS) {
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
    __device__ __noinline__ static ContactSum sum_many(const Solver& s, AreaSearch search, AreaPackets packets, uint listed) {
        uint lane = search.lane, i = search.group.place(search.tile.row, search.tile.column).particle(s, lane), from = 0;
        vec3 velocity = xyz(search.v[search.at]);
        uint* kept = search.partners;
        bool more = true;
        ContactSum sum = {{0, 0, 0}, 0};
        while (__any_sync(ALL_LANES, more)) {
            uint found = 0;
            more = false;
            auto look = [&](const GroupPlace& there) {
                bool is_there = there.has(s, lane);
                vec3 position = {0, 0, 0}, theirs;
                if (is_there) packets.particle_wait(there.particle(s, lane), position, theirs);
                for (uint present = __ballot_sync(ALL_LANES, is_there); present != 0; present &= present - 1) {
                    uint member = __ffs(present) - 1, j = there.particle(s, member);
                    vec3 xj = {__shfl_sync(ALL_LANES, position.x, member), __shfl_sync(ALL_LANES, position.y, member), __shfl_sync(ALL_LANES, position.z, member)};
                    if (!search.exists || j < from || j == i || !is_in_contact(s, pair_of(search.own, xj).length_squared)) continue;
                    // The highest gives way.
                    more |= found == AREA_PARTNERS;
                    if (found == AREA_PARTNERS && kept[(AREA_PARTNERS - 1) * TILE_PARTICLES] < j) continue;
                    uint place = min(found, AREA_PARTNERS - 1);
                    for (; place > 0 && kept[(place - 1) * TILE_PARTICLES] > j; place--) kept[place * TILE_PARTICLES] = kept[(place - 1) * TILE_PARTICLES];
                    kept[place * TILE_PARTICLES] = j;
                    found = min(found + 1, AREA_PARTNERS);
                }
            };
            for (uint which = 0; which < 9; which++) look(search.group.next_to(which).place(search.tile.row, search.tile.column));
            for (uint first = 0; first < listed; first += 32) {
                uint other = search.listed_group(first, listed);
                Coming coming;
                if (other != NONE) coming.ask(packets.boxes + 2 * other, packets.boxes + 2 * other + 1);
                for (uint near = search.near_groups(packets, other, coming); near != 0; near &= near - 1) {
                    look(GroupPlace::of(s, __shfl_sync(ALL_LANES, other, __ffs(near) - 1)));
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
