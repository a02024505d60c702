// How the forces of the partners that were found (`area_search.cuh`, `far_search.cuh`) are summed as the results need it.

// The forces of the partners of a particle, and how many these are.
struct ContactSum {
    vec3 force;
    uint contacts;
};

// Position and velocity of a partner by its key; nothing changes if that is NONE.
__device__ __forceinline__ void partner_load(const AreaPackets& packets, uint key, vec3& position, vec3& velocity) {
    uint entry = key & AREA_IN_PACKETS;
    if (entry != AREA_IN_PACKETS) {
        position = xyz(area_x()[entry]);
        velocity = xyz(area_v()[entry]);
    } else if (key != NONE) {
        packets.particle_wait(key >> 16, position, velocity);
    }
}

// The sum of a number below 32 over the lanes before this one, and over all.
__device__ __forceinline__ uint lanes_before(uint number, uint lane, uint& total) {
    uint before = 0;
    total = 0;
#pragma unroll
    for (uint bit = 0; bit < 5; bit++) {
        uint lanes = __ballot_sync(ALL_LANES, number >> bit & 1);
        before += __popc(lanes & ((1u << lane) - 1)) << bit;
        total += __popc(lanes) << bit;
    }
    return before;
}

// Pairs of a particle that are on their way from shared memory together.
#define PAIRS_AT_ONCE 4

// How many of the partners of a particle have lower keys.
__device__ __forceinline__ uint keys_below(const uint* keys, uint count, uint key) {
    uint below = 0;
#pragma unroll 1
    for (uint first = 0; first < count; first += PAIRS_AT_ONCE) {
#pragma unroll
        for (uint k = first; k < first + PAIRS_AT_ONCE; k++) {
            if (k < count) below += keys[k * TILE_PARTICLES] < key;
        }
    }
    return below;
}

// Looks at the partners of all particles of the group, and sums the forces of those in contact, ascending for each. A lane takes any of the
// pairs, so that few wait for the particle with the most. `here` partners of the particle of the lane are in the area, `far` are not; lanes
// before have `start` pairs, all have `total`.
__device__ __forceinline__ ContactSum contacts_sum(const Solver& s, const AreaView& view, const AreaPackets& packets, uint here, uint far, uint start, uint total) {
    real4* members = area_pairs() + view.part * AREA_PAIRS;
    uint* pairs = area_keys() + view.part * AREA_MEMBERS;
    for (uint k = 0; k < here + far; k++) pairs[start + k] = (k < here ? k : AREA_PARTNERS_HERE + k - here) << 10 | k << 5 | view.lane;
    __syncwarp();
#pragma unroll 1
    for (uint first = 0; first < total; first += 32) {
        uint number = first + view.lane, named = number < total ? pairs[number] : 0, owner = named % GROUP, rank = named >> 5 & 31u;
        uint owner_here = __shfl_sync(ALL_LANES, here, owner), owner_far = __shfl_sync(ALL_LANES, far, owner);
        uint owner_at = __shfl_sync(ALL_LANES, view.at, owner);
        if (number >= total) continue;
        const uint* keys = area_partners() + view.number(owner);
        uint key = keys[(named >> 10) * TILE_PARTICLES], place = number - rank;
        place += keys_below(keys, owner_here, key) + keys_below(keys + AREA_PARTNERS_HERE * TILE_PARTICLES, owner_far, key);
        vec3 xj, vj, force = {0, 0, 0};
        partner_load(packets, key, xj, vj);
        Pair pair = pair_of(xyz(area_x()[owner_at]), xj);
        bool touches = is_in_contact(s, pair.length_squared);
        if (touches) penalty_add(s, pair, xyz(area_v()[owner_at]) - vj, force);
        members[place] = with_w(force, touches ? 1 : 0);
    }
    __syncwarp();
    ContactSum sum = {{0, 0, 0}, 0};
#pragma unroll 1
    for (uint first = 0; first < here + far; first += PAIRS_AT_ONCE) {
#pragma unroll
        for (uint k = first; k < first + PAIRS_AT_ONCE; k++) {
            real4 member = {0, 0, 0, 0};
            if (k < here + far) member = members[start + k];
            // A sum is never -0, so that it stays as it is where there is no contact.
            sum.force = sum.force + xyz(member);
            sum.contacts += member.w > 0 ? 1 : 0;
        }
    }
    __syncwarp();
    return sum;
}
