// The springs of `stencil.cuh` where each thread has two particles of a tile, one above the other: warp w those of rows 2 w and
// 2 w + 1. The particles around a pair are read once for both, and the spring between them stays in registers.
//
// Forces lie in slots, one for each warp and one for the last warp of the tile above. Going down from tile to tile, each warp takes
// the slot above its last one. So what reaches down out of a tile is where the next one looks for it, and springs from above are
// computed anew only where a run of tiles begins.

// Particles of a thread.
#define PAIR 2
#define PAIR_WARPS (TILE_ROWS / PAIR)
#define PAIR_THREADS (32 * PAIR_WARPS)
#define PAIR_SLOTS (PAIR_WARPS + 1)
// A slot has a row for each kind and particle of a thread, but for the springs between these.
#define SLOT_STRIDE (TILE_COLUMNS + HALO + 1)
#define SLOT_ENTRIES (11 * SLOT_STRIDE)
// Forces of all slots.
#define PAIR_FORCES (PAIR_SLOTS * SLOT_ENTRIES)

// Where, in a slot, the force of the spring of a kind is whose first end is particle `k` of a thread, at a column of the tile.
__device__ constexpr int slot_place(int kind, int k, int column) {
    int row = kind < 3 ? 2 * kind + k : kind == 3 ? 10 : 2 * kind - 2 + k;
    return row * SLOT_STRIDE + HALO + column;
}

// Where the slot of a warp starts at first, -1 for the one above the tile.
__device__ __forceinline__ int slot_first(int warp) { return (warp < 0 ? PAIR_SLOTS - 1 : warp) * SLOT_ENTRIES; }

// The same place in the slot above.
__device__ __forceinline__ int slot_above(int place) {
    return place < SLOT_ENTRIES ? place + (PAIR_SLOTS - 1) * SLOT_ENTRIES : place - SLOT_ENTRIES;
}

// The kind of the springs to the particle so many rows and columns further on, STENCIL_KINDS if there are none.
__device__ constexpr int stencil_kind(int rows, int columns) {
    for (int kind = 0; kind < STENCIL_KINDS; kind++) {
        if (stencil_rows(kind) == rows && stencil_columns(kind) == columns) return kind;
    }
    return STENCIL_KINDS;
}

// A spring into the tile from beside it or above: entry of the first end, how far the second is from there, kind, and the place of
// its force in the first tile.
struct PairOuter {
    uint packed;

    __device__ __forceinline__ static PairOuter of(uint kind, int row, int column) {
        uint first = (uint)((row + HALO) * TILE_STRIDE + column + HALO);
        uint further = (uint)(stencil_rows(kind) * TILE_STRIDE + stencil_columns(kind));
        uint place = (uint)(slot_first((row + PAIR) / PAIR - 1) + slot_place(kind, row & 1, column));
        return {first | further << 9 | kind << 16 | place << 19};
    }
    // The one from beside the tile that a thread computes.
    __device__ __forceinline__ static PairOuter of_thread() {
        int row = (int)(threadIdx.x % TILE_ROWS);
        switch (threadIdx.x / TILE_ROWS) {
        case 0: return of(0, row, -1);
        case 1: return of(1, row, -1);
        case 2: return of(1, row, -2);
        case 3: return of(2, row, TILE_COLUMNS);
        case 4: return of(4, row, -1);
        default: return {NONE};
        }
    }
    // Those from above, by number.
    static constexpr uint ABOVE = 5 * TILE_COLUMNS;
    __device__ __forceinline__ static PairOuter from_above(uint number) {
        int column = (int)(number % TILE_COLUMNS);
        switch (number / TILE_COLUMNS) {
        case 0: return of(2, -1, column + 1);
        case 1: return of(3, -1, column);
        case 2: return of(4, -1, column - 1);
        case 3: return of(5, -1, column);
        default: return of(5, -2, column);
        }
    }
    __device__ __forceinline__ bool exists() const { return packed != NONE; }
    __device__ __forceinline__ uint first() const { return packed & 511u; }
    __device__ __forceinline__ uint second() const { return first() + (packed >> 9 & 127u); }
    __device__ __forceinline__ uint kind() const { return packed >> 16 & 7u; }
    // Where slots have moved so many entries further on, up to all there are either way.
    __device__ __forceinline__ int place(int shift) const {
        int moved = (int)(packed >> 19) + shift;
        return moved < 0 ? moved + PAIR_FORCES : moved < PAIR_FORCES ? moved : moved - PAIR_FORCES;
    }
};

// Computes an outer spring. Gives the square of its length.
template <bool PLAIN>
__device__ __forceinline__ real pair_outer_spring(const Solver& s, const real4* x, const real4* v, const PairOuter& outer, int shift, real* forces) {
    uint i = outer.first(), j = outer.second();
    Spring spring = stencil_spring<PLAIN>(s, outer.kind(), xyz(x[i]), xyz(v[i]), xyz(x[j]), xyz(v[j]));
    force_store<PAIR_FORCES>(forces, outer.place(shift), spring.force());
    return spring.length_squared;
}

// Two particles of a thread, and the springs from them to later ones.
struct StencilPair {
    real4 x[PAIR];
    real4 v[PAIR];
    vec3 springs[PAIR][STENCIL_KINDS];

    // Computes the springs of a thread whose first particle is at an entry of the tile, and whose forces belong at a place, `shift`
    // entries from where they did at first. Gives the square of the shortest.
    template <bool PLAIN>
    __device__ __forceinline__ real springs_compute(const Solver& s, const real4* near_x, const real4* near_v, uint at, const PairOuter& outer, real* forces, int place, int shift) {
        real least = REAL_MAX;
#pragma unroll
        for (int rows = 0; rows < PAIR + HALO; rows++) {
#pragma unroll
            for (int columns = -1; columns <= HALO; columns++) {
                bool is_needed = false;
#pragma unroll
                for (int k = 0; k < PAIR; k++) is_needed |= stencil_kind(rows - k, columns) < STENCIL_KINDS;
                if (!is_needed) continue;
                bool is_own = rows < PAIR && columns == 0;
                uint j = at + rows * TILE_STRIDE + columns;
                vec3 xj = xyz(is_own ? x[rows % PAIR] : near_x[j]), vj = xyz(is_own ? v[rows % PAIR] : near_v[j]);
#pragma unroll
                for (int k = 0; k < PAIR; k++) {
                    int kind = stencil_kind(rows - k, columns);
                    if (kind >= STENCIL_KINDS) continue;
                    Spring spring = stencil_spring<PLAIN>(s, kind, xyz(x[k]), xyz(v[k]), xj, vj);
                    springs[k][kind] = spring.force();
                    if (!is_own) force_store<PAIR_FORCES>(forces, place + slot_place(kind, k, 0), springs[k][kind]);
                    least = fmin(spring.length_squared, least);
                }
            }
        }
        if (outer.exists()) least = fmin(pair_outer_spring<PLAIN>(s, near_x, near_v, outer, shift, forces), least);
        return least;
    }

    // Adds the forces of the springs of particle `k`, ascending by neighbours. `above` is the place in the slot above, `mask` that of
    // `stencil_mask`.
    template <bool INSIDE> __device__ __forceinline__ vec3 springs_sum(const real* forces, int place, int above, int k, uint mask, vec3 force) const {
#pragma unroll
        for (int n = 0; n < STENCIL_KINDS; n++) {
            int kind = STENCIL_KINDS - 1 - n, first = k - stencil_rows(kind), columns = stencil_columns(kind);
            if (!INSIDE && !(mask >> n & 1)) continue;
            if (first >= 0 && columns == 0) {
                force = force - springs[first][kind];
            } else {
                force = force - force_load<PAIR_FORCES>(forces, (first < 0 ? above : place) + slot_place(kind, first & 1, -columns));
            }
        }
#pragma unroll
        for (int kind = 0; kind < STENCIL_KINDS; kind++) {
            if (INSIDE || mask >> (STENCIL_KINDS + kind) & 1) force = force + springs[k][kind];
        }
        return force;
    }
};
