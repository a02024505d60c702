// How forces of partners are summed where no particle of the group has more than a few.

// Partners of a particle that a lane has in registers, all at once.
#define PARTNERS_FEW 8

// Sums the forces of those in contact, ascending; each lane those on its particle, two on their way at a time. `here` partners are in the
// area, `far` are not.
__device__ __forceinline__ ContactSum contacts_sum_few(const Solver& s, const AreaView& view, const AreaPackets& packets, uint here, uint far) {
    const uint* listed = area_partners() + view.number(view.lane);
    uint keys[PARTNERS_FEW];
#pragma unroll
    for (uint k = 0; k < PARTNERS_FEW; k++) {
        keys[k] = NONE;
        if (k < here + far) keys[k] = listed[(k < here ? k : AREA_PARTNERS_HERE + k - here) * TILE_PARTICLES];
    }
    auto order = [&](uint a, uint b) {
        uint low = min(keys[a], keys[b]), high = max(keys[a], keys[b]);
        keys[a] = low;
        keys[b] = high;
    };
    // Four of any order take five exchanges; eight take nineteen: two times four, and then those that merge these (Batcher 1968).
    uint most = __reduce_max_sync(ALL_LANES, (int)(here + far));
    order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
    if (most > 4) {
        order(4, 5), order(6, 7), order(4, 6), order(5, 7), order(5, 6);
        order(0, 4), order(1, 5), order(2, 6), order(3, 7);
        order(2, 4), order(3, 5);
        order(1, 2), order(3, 4), order(5, 6);
    }
    vec3 xi = xyz(area_x()[view.at]), vi = xyz(area_v()[view.at]);
    ContactSum sum = {{0, 0, 0}, 0};
#pragma unroll 1
    for (uint first = 0; first < most; first += 2) {
        vec3 forces[2];
        bool touches[2];
#pragma unroll
        for (uint k = 0; k < 2; k++) {
            forces[k] = {0, 0, 0};
            vec3 xj = xi, vj = vi;
            partner_load(packets, keys[k], xj, vj);
            Pair pair = pair_of(xi, xj);
            touches[k] = keys[k] != NONE && is_in_contact(s, pair.length_squared);
            if (touches[k]) penalty_add(s, pair, vi - vj, forces[k]);
        }
#pragma unroll
        for (uint k = 0; k < PARTNERS_FEW - 2; k++) keys[k] = keys[k + 2];
        keys[PARTNERS_FEW - 2] = keys[PARTNERS_FEW - 1] = NONE;
#pragma unroll
        for (uint k = 0; k < 2; k++) {
            sum.force = sum.force + forces[k];
            sum.contacts += touches[k] ? 1 : 0;
        }
    }
    return sum;
}
