// Tiles of a regular patch, by blocks of 256 threads with a particle each.

// A tile by its place in the patch.
struct TilePlace {
    uint column;
    uint row;

    __device__ __forceinline__ void next(uint across) {
        column++;
        if (column == across) {
            column = 0;
            row++;
        }
    }
};

// Particles of a tile and around it that a thread loads.
#define LOADS ((TILE_WIDTH * TILE_HEIGHT + 255) / 256)

// One of them: its number less that of the first particle of the tile, its column and row counted from there, and its entry.
struct TileLoad {
    int relative;
    uint packed;

    __device__ __forceinline__ static TileLoad of_thread(const Solver& s, uint number) {
        uint at = threadIdx.x + 256 * number;
        uint row = at / TILE_WIDTH, column = at % TILE_WIDTH;
        int relative = ((int)row - HALO) * (int)s.columns + (int)column - HALO;
        if (row >= TILE_HEIGHT) return {0, 0xffffffffu};
        return {relative, row * TILE_STRIDE + column | row << 16 | column << 24};
    }
    __device__ __forceinline__ bool exists() const { return packed != 0xffffffffu; }
    __device__ __forceinline__ uint entry() const { return packed & 0xffffu; }
    __device__ __forceinline__ uint row() const { return packed >> 16 & 0xffu; }
    __device__ __forceinline__ uint column() const { return packed >> 24; }
};

// The column and row in a tile, 32 by 8, such that a warp has a group, 8 by 4.
__device__ __forceinline__ void tile_place_in_group(uint& column, uint& row) {
    uint lane = threadIdx.x & 31, warp = threadIdx.x / 32;
    column = warp % 4 * 8 + lane % 8;
    row = warp / 4 * 4 + lane / 8;
}

// Starts to load a tile with its surroundings, by 256 threads. Where there are no registers to keep what a thread loads, it is found
// anew.
template <bool KEEPS_LOADS>
__device__ __forceinline__ void tile_start(const Solver& s, const Motion& motion, const TilePlace& place, const TileLoad* loads, real4* x, real4* v) {
    uint column = place.column * TILE_COLUMNS, row = place.row * TILE_ROWS;
    uint first = row * s.columns + column;
    bool inside = column >= HALO && row >= HALO && column + TILE_COLUMNS + HALO <= s.columns && row + TILE_ROWS + HALO <= s.rows;
#pragma unroll
    for (uint number = 0; number < LOADS; number++) {
        const TileLoad load = KEEPS_LOADS ? loads[number] : TileLoad::of_thread(s, number);
        bool exists = load.exists();
        if (!inside) exists &= column + load.column() - HALO < s.columns && row + load.row() - HALO < s.rows;
        if (exists) {
            uint j = first + load.relative;
            copy_start(&x[load.entry()], &motion.x[j]);
            copy_start(&v[load.entry()], &motion.v[j]);
        }
    }
}

// A substep of one particle of a tile, with `found` partners: gives where it gets to. The springs of the tile are in `forces`, and
// those that its thread has computed in `springs` unless that is null. `inside` says that the particle has all springs.
template <bool PENALTY, bool EXTRAS, bool HAS_OWN>
__device__ __forceinline__ vec3 stencil_substep_store(
    const Solver& s, const Motion& motion, const SubstepData& substep, const Collider* colliders, const real4& own, const real4& rate, uint i,
    const real4* partners, uint found, bool stopped, real4* next_x, real4* next_v, uint& total, bool& finite,
    const real* forces, uint row, uint column, bool inside, const vec3* springs, real offset
) {
    uint contacts = 0;
    Moved moved = {xyz(own), xyz(rate)};
    if (!stopped) {
        vec3 force = field_force(s, rate.w, xyz(rate));
        force = procedural_force(substep, i, xyz(own), xyz(rate), rate.w, force);
        if (inside) {
            force = stencil_sum<true, HAS_OWN>(forces, row, column, 0, springs, force);
        } else {
            force = stencil_sum<false, HAS_OWN>(forces, row, column, stencil_mask(s, i / s.columns, i % s.columns), springs, force);
        }
        moved = particle_finish<PENALTY, EXTRAS>(s, motion, substep, colliders, i, own, rate, partners, found, true, force, offset, contacts);
    }
    finite &= particle_store(s, next_x, next_v, substep, i, moved, own.w, rate.w);
    total += contacts;
    return moved.position;
}
