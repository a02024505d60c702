// A group of a patch and those around it, which a warp looks at when something there may touch (`flat.cuh`).

// Particles of a group that a lane compares with those of the groups around.
#define APART_OWN 4

// The particles of a group and of those around it, in shared memory of a warp.
struct AroundGroup {
    static constexpr int COLUMNS = 24;
    static constexpr int ROWS = 12;
    // Groups that there is room for.
    static constexpr int TOGETHER = COLUMNS * ROWS / GROUP;

    // And a row that is loaded with others, but looked at by nobody.
    real4 x[COLUMNS * (ROWS + 1)];

    // The entry of the particle of a lane in one of the nine groups.
    __device__ __forceinline__ static int entry(int which, int lane) { return (which / 3 * 4 + lane / 8) * COLUMNS + which % 3 * 8 + lane % 8; }
    __device__ __forceinline__ static bool is_inside(const Solver& s, uint row, uint column) {
        return row >= 4 && column >= 8 && row + 8 <= s.rows && column + 16 <= s.columns;
    }
    // Starts to load all around the group whose first particle is at a row and column.
    __device__ __forceinline__ void start(const Solver& s, const real4* from, uint row, uint column, uint lane) {
        uint first = (row + lane / 8) * s.columns + column + lane % 8;
#pragma unroll
        for (int which = 0; which < 9; which++) {
            int rows = (which / 3 - 1) * 4, columns = (which % 3 - 1) * 8;
            if (row + rows + lane / 8 < s.rows && column + columns + lane % 8 < s.columns) {
                copy_start(&x[entry(which, (int)lane)], &from[first + rows * (int)s.columns + columns]);
            }
        }
    }
    // Whether all edges that a lane looks at are flat in directions of the group.
    template <bool INSIDE> __device__ __forceinline__ bool is_flat(const Solver& s, uint row, uint column, int lane) const {
        // Where the group is wider than the patch there is nothing to gain.
        if (!INSIDE && (row + 4 > s.rows || column + 8 > s.columns)) return false;
        vec3 columns = xyz(x[entry(4, 23)]) - xyz(x[entry(4, 16)]), rows = xyz(x[entry(4, 28)]) - xyz(x[entry(4, 4)]);
        directions_part(columns, rows);
        TileFlat asked = {{columns, rows, cross(columns, rows)}, FLAT_ALONG * s.contact_distance, FLAT_ACROSS * s.contact_distance, 0, true};
        bool flat = true;
#pragma unroll
        for (int which = 0; which < 9; which++) {
            bool has_right = which % 3 < 2 || lane % 8 < 7, has_below = which / 3 < 2 || lane / 8 < 3;
            if (!INSIDE) {
                uint r = row + (which / 3 - 1) * 4 + lane / 8, c = column + (which % 3 - 1) * 8 + lane % 8;
                has_right &= r < s.rows && c < s.columns && c + 1 < s.columns;
                has_below &= r < s.rows && c < s.columns && r + 1 < s.rows;
            }
            const real4* at = &x[entry(which, lane)];
            flat &= asked.holds_shared(s, 0, xyz(at[1]) - xyz(at[0])) | !has_right;
            flat &= asked.holds_shared(s, 1, xyz(at[COLUMNS]) - xyz(at[0])) | !has_below;
        }
        return flat;
    }
    // Whether the particles of the group are surely farther than the contact distance from all others, but for those that springs join to
    // them, whose springs are longer. `box` is around all that may touch some particle of the group: what is in it is put together, the
    // group first, as positions from its middle with their squares, in place of the positions.
    __device__ __forceinline__ bool is_apart(const Solver& s, uint row, uint column, uint lane, const Box& box) {
        vec3 middle = (real)0.5 * (box.low + box.high), low = box.low - middle, high = box.high - middle;
        vec3 from[9];
        uint near = 0;
        real greatest = 0;
#pragma unroll
        for (int which = 0; which < 9; which++) {
            uint r = row + (which / 3 - 1) * 4 + lane / 8, c = column + (which % 3 - 1) * 8 + lane % 8;
            from[which] = xyz(x[entry(which, (int)lane)]) - middle;
            if (!(r < s.rows && c < s.columns)) continue;
            near |= box_holds({low, high}, from[which]) ? 1u << which : 0;
            greatest = maximum(greatest, dot(from[which], from[which]));
        }
        __syncwarp();
        bool exists = row + lane / 8 < s.rows && column + lane % 8 < s.columns;
        x[lane] = exists ? with_w(from[4], dot(from[4], from[4])) : real4{0, 0, 0, REAL_MAX};
        uint count = GROUP;
#pragma unroll
        for (int which = 0; which < 9; which++) {
            if (which == 4) continue;
            uint all = __ballot_sync(ALL_LANES, near >> which & 1);
            if (near >> which & 1) x[count + __popc(all & (1u << lane) - 1)] = with_w(from[which], dot(from[which], from[which]));
            count += __popc(all);
        }
        greatest = warp_maximum(greatest);
        __syncwarp();
        // Eight lanes have all of the group, and every fourth of the others.
        vec3 doubled[APART_OWN];
        real least[APART_OWN], squared[APART_OWN];
#pragma unroll
        for (uint j = 0; j < APART_OWN; j++) {
            real4 own = x[lane % 8 + 8 * j];
            doubled[j] = (real)-2 * xyz(own);
            squared[j] = own.w;
            least[j] = REAL_MAX;
        }
        auto compare = [&](uint k, uint but) {
            real4 other = x[k];
#pragma unroll
            for (uint j = 0; j < APART_OWN; j++) {
                real part = fma(doubled[j].x, other.x, fma(doubled[j].y, other.y, fma(doubled[j].z, other.z, other.w)));
                if (lane % 8 + 8 * j != but) least[j] = fmin(part, least[j]);
            }
        };
#pragma unroll 2
        for (uint k = lane / 8; k < GROUP; k += 4) compare(k, k);
#pragma unroll 2
        for (uint k = GROUP + lane / 8; k < count; k += 4) compare(k, NONE);
        // With what rounding may take away; written so that what is not a number is not apart.
        real enough = (real)1.001 * s.contact_distance * s.contact_distance + (real)32 * REAL_EPSILON * greatest;
        bool apart = true;
#pragma unroll
        for (uint j = 0; j < APART_OWN; j++) apart &= squared[j] + least[j] >= enough;
        return __all_sync(ALL_LANES, apart);
    }
    // The square of the shortest spring of the particle of a lane, which has those of a mask.
    __device__ __forceinline__ real springs_least(uint mask, int lane) const {
        const real4* at = &x[entry(4, lane)];
        real least = REAL_MAX;
#pragma unroll
        for (int k = 0; k < 2 * STENCIL_KINDS; k++) {
            int kind = k < STENCIL_KINDS ? STENCIL_KINDS - 1 - k : k - STENCIL_KINDS, sign = k < STENCIL_KINDS ? -1 : 1;
            vec3 difference = xyz(at[sign * (stencil_rows(kind) * COLUMNS + stencil_columns(kind))]) - xyz(at[0]);
            if (mask >> k & 1) least = fmin(dot(difference, difference), least);
        }
        return least;
    }
    // Adds the forces of its springs, ascending by neighbours, to those on particle `i`.
    __device__ __forceinline__ vec3 springs_add(const Solver& s, const Motion& motion, uint i, uint mask, int lane, const vec3& vi, vec3 force) const {
        const real4* at = &x[entry(4, lane)];
#pragma unroll 4
        for (int k = 0; k < 2 * STENCIL_KINDS; k++) {
            int kind = k < STENCIL_KINDS ? STENCIL_KINDS - 1 - k : k - STENCIL_KINDS, sign = k < STENCIL_KINDS ? -1 : 1;
            int rows = sign * stencil_rows(kind), columns = sign * stencil_columns(kind);
            if (!(mask >> k & 1)) continue;
            SpringKind numbers = {s.stencil[kind][0], s.stencil[kind][1], s.stencil[kind][2], nullptr};
            vec3 vj = xyz(motion.v[i + rows * (int)s.columns + columns]);
            force = force + spring_at(numbers, xyz(at[0]), vi, xyz(at[rows * COLUMNS + columns]), vj).force();
        }
        return force;
    }
};

// As `group_contacts_visit` does it, but with the particles of several groups on their way at once, into the memory of those around.
// `near` says which groups of the list, `other` of a lane, come near.
template <typename Visit>
__device__ __forceinline__ void around_contacts_visit(
    const Solver& s, const GroupsOfPatch& groups, uint group, uint lane, const GroupView& view, uint near, uint other, uint listed, AroundGroup& around, Visit visit
) {
    __syncwarp();
    for (uint first = 0; first < listed; first += 32) {
        if (first > 0) {
            other = list_entry(s, group, lane, first, listed);
            near = __ballot_sync(ALL_LANES, first + lane < listed && boxes_meet(view.box, groups.box(other)));
        }
        while (near != 0) {
            uint count = min((uint)__popc(near), (uint)AroundGroup::TOGETHER), mine = 0;
            for (uint k = 0; k < count; k++) {
                uint from = __shfl_sync(ALL_LANES, other, __ffs(near) - 1), row, column;
                near &= near - 1;
                if (lane == k) mine = from;
                GroupsOfPatch::place(s, from, lane, row, column);
                if (row < s.rows && column < s.columns) {
                    copy_start(&around.x[k * GROUP + lane], &groups.x[row * s.columns + column]);
                } else {
                    around.x[k * GROUP + lane] = {REAL_MAX, REAL_MAX, REAL_MAX, 0};
                }
            }
            copies_wait();
            __syncwarp();
            for (uint k = 0; k < count; k++) {
                const real4* members = &around.x[k * GROUP];
                uint present = __shfl_sync(ALL_LANES, mine, k);
                uint inside = __ballot_sync(ALL_LANES, box_holds(view.box, xyz(members[lane])));
                if (inside == 0) continue;
                uint hits = members_in_contact(s, view, members, inside);
                if (present == group) hits &= ~(1u << lane);
                for (; hits != 0; hits &= hits - 1) visit(present, __ffs(hits) - 1, xyz(members[__ffs(hits) - 1]));
            }
            __syncwarp();
        }
    }
}

// Whether the group whose first particle is at a row and column, and those around it, were found flat in a substep.
__device__ __forceinline__ bool group_is_flat(const Solver& s, uint row, uint column, uint lane, uint tick) {
    row += (lane / 3 - 1) * 4;
    column += (lane % 3 - 1) * 8;
    bool is_rough = false;
    if (lane < 9 && row < s.rows && column < s.columns) {
        uint2 found = s.tile_rough[row / TILE_ROWS * tiles_across(s) + column / TILE_COLUMNS];
        is_rough = found.x == tick && found.y >> (row % TILE_ROWS / 4 * 4 + column % TILE_COLUMNS / 8) & 1;
    }
    return !__any_sync(ALL_LANES, is_rough);
}

// Whether a group of a patch is one of those around another.
__device__ __forceinline__ bool groups_are_around(const Solver& s, uint group, uint other) {
    uint rows[2], columns[2];
    GroupsOfPatch::place(s, group, 0, rows[0], columns[0]);
    GroupsOfPatch::place(s, other, 0, rows[1], columns[1]);
    return rows[1] + 4 - rows[0] <= 8 && columns[1] + 8 - columns[0] <= 16;
}
