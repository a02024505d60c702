// How a warp searches for the partners of a group of the tile in the area: what is in reach is put together and compared at once.

struct AreaSearch : AreaView {
    __device__ __forceinline__ AreaSearch(const Solver& s, const GroupPlace& tile, uint part, uint lane) : AreaView(s, tile, part, lane) {}

    __device__ __forceinline__ uint members_first() const { return part * AREA_MEMBERS; }

    // The substep begins.
    __device__ __forceinline__ void start(const Solver& s) {
        look(s);
        area_sketches()[members_first() + lane] = see(s);
        area_keys()[members_first() + lane] = key;
        count = GROUP;
        found = 0;
    }

    // Takes the groups around it that are in the tile, or those that are not: the particle of a lane is as far from its own as the groups are. Five
    // at most, for which there is room beside the group: three of the row above or below, and two others.
    __device__ __forceinline__ void take_around(const Solver& s, bool in_tile) {
        uint column = part % 4;
        bool is_first = column == 0, is_last = column == 3, is_above = part < 4;
        // How far they are, by groups. The two others are beside it on both sides; or on the outer side of the tile, one of each row.
        int row = is_above == in_tile ? 1 : -1, last_row = in_tile ? 0 : -row, outer = is_first ? -1 : 1;
        // What is not in the tile is not to be looked at while it comes: in its place there is what is.
        int left = in_tile && is_first ? 0 : -1, right = in_tile && is_last ? 0 : 1;
        int rows[5] = {row, row, row, 0, last_row}, columns[5] = {left, 0, right, in_tile ? left : outer, in_tile ? right : outer};
        // Which of the five there are, a bit each.
        uint exist = in_tile ? (is_first ? 0x16u : is_last ? 0x0bu : 0x1fu) : (is_first || is_last ? 0x1fu : 0x07u);
        vec3 seen[5];
        uint inside[5];
#pragma unroll
        for (int k = 0; k < 5; k++) seen[k] = xyz(area_x()[(int)at + rows[k] * (GROUP_ROWS * AREA_STRIDE) + columns[k] * GROUP_COLUMNS]) - middle;
#pragma unroll
        for (int k = 0; k < 5; k++) inside[k] = __ballot_sync(ALL_LANES, is_in_reach(seen[k]));
#pragma unroll
        for (int k = 0; k < 5; k++) {
            if (!(exist >> k & 1) || inside[k] == 0) continue;
            int down = rows[k] * GROUP_ROWS, across = columns[k] * GROUP_COLUMNS;
            uint numbers = (uint)(down * (int)s.columns + across), entries = (uint)(down * AREA_STRIDE + across);
            take(members_first(), inside[k], seen[k], key + (numbers << 16) + entries);
        }
    }

    // Compares with what there is, but for what `skipped` has of it (`find`).
    __device__ __forceinline__ void compare(uint skipped) {
        members_end(members_first());
        find(members_first(), members_first() + count, skipped, area_partners(), AREA_PARTNERS_HERE);
        __syncwarp();
        count = 0;
    }
};
