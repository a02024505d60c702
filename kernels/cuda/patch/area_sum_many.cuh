// How forces of partners are summed where there was no room for all partners.

// Looks for them once more, as many at a time as fit, from the lowest on. By value, as who is called may change what it has the address
// of.
__device__ __noinline__ ContactSum contacts_sum_many(const Solver& s, AreaView view, AreaPackets packets, uint listed) {
    uint lane = view.lane, i = view.key >> 16, from = 0;
    vec3 own = xyz(area_x()[view.at]), velocity = xyz(area_v()[view.at]);
    uint* kept = area_partners() + view.number(view.lane);
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
                if (!view.exists || j < from || j == i || !is_in_contact(s, pair_of(own, xj).length_squared)) continue;
                // The highest gives way.
                more |= found == AREA_PARTNERS_HERE;
                if (found == AREA_PARTNERS_HERE && kept[(AREA_PARTNERS_HERE - 1) * TILE_PARTICLES] < j) continue;
                uint place = min(found, AREA_PARTNERS_HERE - 1);
                for (; place > 0 && kept[(place - 1) * TILE_PARTICLES] > j; place--) kept[place * TILE_PARTICLES] = kept[(place - 1) * TILE_PARTICLES];
                kept[place * TILE_PARTICLES] = j;
                found = min(found + 1, AREA_PARTNERS_HERE);
            }
        };
        for (uint which = 0; which < 9; which++) look(AreaGroup::of_tile(view.part).next_to(which).place(view.tile.row, view.tile.column));
        for (uint first = 0; first < listed; first += 32) {
            uint other = view.listed_group(s, first, listed);
            Coming coming;
            packets.box_ask(other, coming);
            for (uint near = view.near_groups(packets, other, coming); near != 0; near &= near - 1) {
                look(GroupPlace::of(s, __shfl_sync(ALL_LANES, other, __ffs(near) - 1)));
            }
        }
        for (uint k = 0; k < found; k++) {
            uint j = kept[k * TILE_PARTICLES];
            vec3 xj, vj;
            packets.particle_wait(j, xj, vj);
            penalty_add(s, pair_of(own, xj), velocity - vj, sum.force);
            from = j + 1;
        }
        sum.contacts += found;
    }
    return sum;
}
