// Tiles of a large patch in runs that go down through it strip by strip, with two particles a thread (`pairs.cuh`).

// A tile by its first particle.
struct StripTile {
    uint row;
    uint column;

    static __device__ __forceinline__ uint down(const Solver& s) { return (s.rows + TILE_ROWS - 1) / TILE_ROWS; }
    static __device__ __forceinline__ uint count(const Solver& s) { return down(s) * ((s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS); }
    static __device__ __forceinline__ StripTile of(const Solver& s, uint number) {
        return {number % down(s) * TILE_ROWS, number / down(s) * TILE_COLUMNS};
    }
    __device__ __forceinline__ void next(const Solver& s) {
        row += TILE_ROWS;
        if (row >= s.rows) {
            row = 0;
            column += TILE_COLUMNS;
        }
    }
};

// Tiles of a block, as even as can be.
struct StripRun {
    uint first;
    uint end;

    static __device__ __forceinline__ StripRun of(const Solver& s, uint block) {
        ulong tiles = StripTile::count(s);
        return {(uint)(block * tiles / gridDim.x), (uint)((block + 1) * tiles / gridDim.x)};
    }
};

// One of the particles around a tile that a thread loads: below it, beside, above, in this order as the last are seldom needed.
struct AroundLoad {
    static constexpr uint BELOW = HALO * TILE_COLUMNS;
    static constexpr uint BESIDE = 2 * HALO * (TILE_ROWS + HALO);
    static constexpr uint ABOVE = HALO * TILE_WIDTH;
    static constexpr uint TURNS = (BELOW + BESIDE + ABOVE + PAIR_THREADS - 1) / PAIR_THREADS;

    // Entry, row and column, and whether it is above the tile.
    uint packed;

    __device__ __forceinline__ static AroundLoad of_thread(uint turn) {
        uint number = threadIdx.x + turn * PAIR_THREADS, row, column;
        if (number < BELOW) {
            row = HALO + TILE_ROWS + number / TILE_COLUMNS;
            column = HALO + number % TILE_COLUMNS;
        } else if (number < BELOW + BESIDE) {
            row = HALO + (number - BELOW) / (2 * HALO);
            column = (number - BELOW) % (2 * HALO);
            if (column >= HALO) column += TILE_COLUMNS;
        } else {
            row = (number - BELOW - BESIDE) / TILE_WIDTH;
            column = (number - BELOW - BESIDE) % TILE_WIDTH;
            if (row >= HALO) return {NONE};
        }
        return {row * TILE_STRIDE + column | row << 16 | column << 20 | (row < HALO ? 1u << 26 : 0u)};
    }
    __device__ __forceinline__ bool is_needed(bool is_first) const { return packed >> (is_first ? 27 : 26) == 0; }
    __device__ __forceinline__ uint entry() const { return packed & 0xffffu; }
    // From the first particle of the tile; may be before those of the patch.
    __device__ __forceinline__ uint row() const { return (packed >> 16 & 15u) - HALO; }
    __device__ __forceinline__ uint column() const { return (packed >> 20 & 63u) - HALO; }
};

// Starts to load a tile with its surroundings, of those above only if it is the first of a run. Each warp loads every fourth row. If
// `FILLS`, what is not in the patch is far away from all, and from each other, so that springs to it are long.
template <bool FILLS>
__device__ __forceinline__ void strip_tile_start(const Solver& s, const Motion& motion, const StripTile& tile, bool is_first, const AroundLoad* loads, real4* x, real4* v) {
    bool inside = stencil_is_inside(s, tile.row, tile.column);
    uint first = tile.row * s.columns + tile.column;
    auto load = [&](uint row, uint column, uint entry) {
        if (inside || tile.row + row < s.rows && tile.column + column < s.columns) {
            uint j = first + row * s.columns + column;
            copy_start(&x[entry], &motion.x[j]);
            copy_start(&v[entry], &motion.v[j]);
        } else if (FILLS) {
            x[entry] = {(real)1e15 * (real)(entry + 1), 0, 0, 0};
        }
    };
    uint column = threadIdx.x % 32;
#pragma unroll
    for (uint part = 0; part < PAIR; part++) {
        uint row = threadIdx.x / 32 + part * PAIR_WARPS;
        load(row, column, (row + HALO) * TILE_STRIDE + column + HALO);
    }
#pragma unroll
    for (uint turn = 0; turn < AroundLoad::TURNS; turn++) {
        const AroundLoad& around = loads[turn];
        if (around.is_needed(is_first)) load(around.row(), around.column(), around.entry());
    }
}

// Computes the springs of the pair of a thread at an entry of a tile, and those that reach into the tile: from above only if it is the
// first of a run. Gives the square of the shortest. `place` is where the forces belong, `place_first` where they did in the first tile.
__device__ __forceinline__ real strip_springs(
    const Solver& s, StencilPair& pair, const real4* x, const real4* v, uint at, const PairOuter& outer, real* forces, int place, int place_first, bool is_first
) {
    int shift = place - place_first;
    real least = pair.springs_compute<true>(s, x, v, at, outer, forces, place, shift);
#if !defined(CLOTH_FAST) && !defined(CLOTH_F64)
    if (least < ROOT_PLAIN_MIN) pair.springs_compute<false>(s, x, v, at, outer, forces, place, shift);
#endif
    if (is_first) {
        for (uint n = threadIdx.x; n < PairOuter::ABOVE; n += PAIR_THREADS) {
            pair_outer_spring<false>(s, x, v, PairOuter::from_above(n), shift, forces);
        }
    }
    return least;
}

// Where particle `k` of a pair, number `i` of the patch, at a row and column, gets to where nothing but fields, springs and colliders
// acts. `inside` says that it has all springs.
__device__ __forceinline__ Moved strip_move(
    const Solver& s, const SubstepData& substep, const Collider* colliders, const StencilPair& pair, uint k, uint i, uint row, uint column, bool inside,
    const real* forces, int place, int above, real offset
) {
    vec3 xi = xyz(pair.x[k]), vi = xyz(pair.v[k]);
    real inverse_mass = pair.x[k].w, mass = pair.v[k].w;
    vec3 force = field_force(s, mass, vi);
    force = procedural_force(substep, i, xi, vi, mass, force);
    if (inside) {
        force = pair.springs_sum<true>(forces, place, above, k, 0, force);
    } else {
        force = pair.springs_sum<false>(forces, place, above, k, stencil_mask(s, row, column), force);
    }
    Moved moved = integrate(substep.length, inverse_mass, force, xi, vi);
    if (inverse_mass > 0) collide_all<false>(s, colliders, i, offset, inverse_mass, xi, substep.length, moved);
    return moved;
}

// Once a number is not finite nothing changes any more, but a frame goes to its end: takes the state after `done` of its substeps to
// where it is after all.
__device__ __forceinline__ void state_carry(const Solver& s, uint done, uint substeps) {
    uint from = state_after(s, done), to = state_after(s, substeps);
    for (uint i = blockIdx.x * PAIR_THREADS + threadIdx.x; i < s.count && from != to; i += gridDim.x * PAIR_THREADS) {
        s.position[to][i] = s.position[from][i];
        s.velocity[to][i] = s.velocity[from][i];
    }
}
