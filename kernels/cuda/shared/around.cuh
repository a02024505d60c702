// A group of a patch and those around it, which a warp looks at when something there may touch (`flat.cuh`).

// So few are compared one by one.
#define APART_FEW 14

// The particles of a group and of those around it, in shared memory of a warp.
struct AroundGroup {
    static constexpr int COLUMNS = 24;
    static constexpr int ROWS = 12;

    real4 x[COLUMNS * ROWS];
    real4 stage[GROUP];

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
            // What lies behind the last row is memory too, and looked at by nobody.
            const real4* at = &x[entry(which, lane)];
            flat &= asked.holds_shared(s, 0, xyz(at[1]) - xyz(at[0])) | !has_right;
            flat &= asked.holds_shared(s, 1, xyz(at[COLUMNS]) - xyz(at[0])) | !has_below;
        }
        return flat;
    }
    // Whether the particle of a lane is surely farther than the contact distance from all others, but for those that springs join to
    // it, whose springs are longer. `box` is around all that may touch some particle of the group. In place of positions there are
    // then those from its middle, with their squares.
    __device__ __forceinline__ bool is_apart(const Solver& s, uint row, uint column, int lane, const Box& box) {
        vec3 middle = (real)0.5 * (box.low + box.high), low = box.low - middle, high = box.high - middle;
        real greatest = 0;
#pragma unroll
        for (int which = 0; which < 9; which++) {
            uint r = row + (which / 3 - 1) * 4 + lane / 8, c = column + (which % 3 - 1) * 8 + lane % 8;
            real4& entry_x = x[entry(which, lane)];
            vec3 from = xyz(entry_x) - middle;
            real squared = dot(from, from);
            bool exists = r < s.rows && c < s.columns;
            entry_x = exists ? with_w(from, squared) : real4{0, 0, 0, REAL_MAX};
            if (exists) greatest = maximum(greatest, squared);
        }
        greatest = warp_maximum(greatest);
        __syncwarp();
        real4 own = x[entry(4, lane)];
        vec3 doubled = (real)-2 * xyz(own);
        real least = REAL_MAX;
#pragma unroll 1
        for (int which = 0; which < 9; which++) {
            const real4* first = &x[entry(which, 0)];
            uint near = __ballot_sync(ALL_LANES, box_holds({low, high}, xyz(x[entry(which, lane)])));
            if (near == 0) continue;
            if (which != 4 && __popc(near) <= APART_FEW) {
                while (near != 0) {
                    int k = __ffs(near) - 1;
                    near &= near - 1;
                    real4 other = first[k / 8 * COLUMNS + k % 8];
                    least = fmin(fma(doubled.x, other.x, fma(doubled.y, other.y, fma(doubled.z, other.z, other.w))), least);
                }
                continue;
            }
#pragma unroll
            for (int k = 0; k < GROUP; k++) {
                real4 other = first[k / 8 * COLUMNS + k % 8];
                real squared = fma(doubled.x, other.x, fma(doubled.y, other.y, fma(doubled.z, other.z, other.w)));
                least = fmin(which == 4 && k == lane ? REAL_MAX : squared, least);
            }
        }
        // With what rounding may take away; written so that what is not a number is not apart.
        real enough = (real)1.001 * s.contact_distance * s.contact_distance + (real)32 * REAL_EPSILON * greatest;
        return own.w + least >= enough;
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
