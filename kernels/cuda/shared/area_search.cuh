// How a warp searches for the partners of a group of the tile in the area: what is in reach is put together and compared at once.

struct AreaSearch : AreaView {
    // Which of the nine groups around it, its own among them, are in the tile, a bit each.
    uint in_tile;
    // The first that it is looked for.
    uint first;
    // Whether there were partners in the last substep.
    bool is_rough;

    __device__ __forceinline__ AreaSearch(const Solver& s, const GroupPlace& tile, uint part, uint lane) : AreaView(s, tile, part, lane), in_tile(0) {
        for (uint k = 0; k < 9; k++) in_tile |= AreaGroup::of_tile(part).next_to(k).is_of_tile() ? 1u << k : 0;
    }

    __device__ __forceinline__ uint members_first() const { return part * AREA_MEMBERS; }

    // The substep begins: gives the box of the group.
    __device__ __forceinline__ Box start(const Solver& s) {
        Box box = look(s);
        real4 seen = see(s);
        area_members()[members_first() + lane] = exists ? seen : real4{0, 0, 0, REAL_MAX};
        area_keys()[members_first() + lane] = key;
        count = GROUP;
        return box;
    }

    // Whether a lane has a difference that is small enough. Written so that what is not a number is.
    __device__ __forceinline__ bool is_near(real least) const { return __any_sync(ALL_LANES, exists && !(least >= most && most <= REAL_MAX)); }

    // Compares the group with itself, if nothing was near anything of it in the last substep each pair once to know whether it is.
    __device__ __forceinline__ void compare_own() {
        is_rough = __any_sync(ALL_LANES, found > 0);
        found = 0;
        __syncwarp();
        bool near = is_rough;
        if (!near) {
            real least = REAL_MAX;
#pragma unroll AREA_AT_ONCE
            for (uint k = 1; k <= GROUP / 2; k++) least = fmin(least, difference(area_members()[members_first() + (lane + k) % GROUP]));
            near = is_near(least);
        }
        first = near ? 0 : GROUP;
    }

    // Takes those of the nine groups that `groups` has, a bit each: the particle of a lane is as far from its own as the groups are. At most
    // five are in the tile but for the group, as are at most five not: there is room for them and the group.
    __device__ __forceinline__ void take_around(const Solver& s, uint groups) {
        vec3 seen[9];
        uint inside[9];
#pragma unroll
        for (int k = 0; k < 9; k++) {
            seen[k] = {REAL_MAX, REAL_MAX, REAL_MAX};
            if (k != 4 && groups >> k & 1) seen[k] = xyz(area_x()[(int)at + area_entries(k)]) - middle;
        }
#pragma unroll
        for (int k = 0; k < 9; k++) inside[k] = k == 4 ? 0 : __ballot_sync(ALL_LANES, is_in_reach(seen[k]));
#pragma unroll
        for (int k = 0; k < 9; k++) {
            if (k == 4 || inside[k] == 0) continue;
            uint numbers = (uint)((k / 3 - 1) * GROUP_ROWS * (int)s.columns + (k % 3 - 1) * GROUP_COLUMNS);
            take(members_first(), inside[k], seen[k], key + (numbers << 16) + (uint)area_entries(k));
        }
    }

    // Compares with what there is, and the first time with the group itself where something in it is near. If nothing was near in the last
    // substep it is looked first whether anything is.
    __device__ __forceinline__ void compare() {
        if (lane < AREA_AT_ONCE) area_members()[members_first() + count + lane] = {0, 0, 0, REAL_MAX};
        __syncwarp();
        bool near = is_rough;
        if (!near) {
            real least = REAL_MAX;
#pragma unroll 1
            for (uint k = GROUP; k < count; k += AREA_AT_ONCE) {
#pragma unroll
                for (uint l = 0; l < AREA_AT_ONCE; l++) least = fmin(least, difference(area_members()[members_first() + k + l]));
            }
            near = is_near(least);
        }
        find(members_first() + first, members_first() + (near ? count : GROUP), area_partners(), AREA_PARTNERS_HERE);
        __syncwarp();
        first = count = GROUP;
    }
};
