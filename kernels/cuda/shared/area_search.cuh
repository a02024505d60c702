// How a warp searches for the partners of a group of the tile in the area: what is in reach is put together and compared at once.

struct AreaSearch : AreaView {
    // Which of the nine groups around it, its own among them, are in the tile, a bit each.
    uint in_tile;

    __device__ __forceinline__ AreaSearch(const Solver& s, const GroupPlace& tile, uint part, uint lane) : AreaView(s, tile, part, lane), in_tile(0) {
        for (uint k = 0; k < 9; k++) in_tile |= AreaGroup::of_tile(part).next_to(k).is_of_tile() ? 1u << k : 0;
    }

    __device__ __forceinline__ uint members_first() const { return part * AREA_MEMBERS; }

    // The substep begins: gives the box of the group.
    __device__ __forceinline__ Box start(const Solver& s) {
        Box box = look(s);
        area_sketches()[members_first() + lane] = see(s);
        area_keys()[members_first() + lane] = key;
        count = GROUP;
        found = 0;
        return box;
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

    // Compares with what there is, but for what `skipped` has of it (`find`).
    __device__ __forceinline__ void compare(uint skipped) {
        __syncwarp();
        find(members_first(), members_first() + count, skipped, area_partners(), AREA_PARTNERS_HERE);
        __syncwarp();
        count = 0;
    }
};
