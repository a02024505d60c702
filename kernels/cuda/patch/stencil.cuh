// NUMERICS section 2 in a tile of a regular patch of one kind of cloth, 12 neighbours each: every spring is computed
// once, by its first end, and put into shared memory, where its other end subtracts it. The negative of a force is exact,
// so that the sums are those of a gather. Of springs that reach into the tile from before it some threads compute one more.

// In ascending order of the second end.
#define STENCIL_KINDS 6
// Forces: one row of a kind for each row that its first ends are in. Their first two components lie together.
#define FORCE_STRIDE (TILE_WIDTH + 1)
#define STENCIL_FORCES (53 * FORCE_STRIDE)

__device__ constexpr int stencil_rows(uint kind) { return kind < 2 ? 0 : kind < 5 ? 1 : 2; }
__device__ constexpr int stencil_columns(uint kind) { return kind == 2 ? -1 : kind == 3 || kind == 5 ? 0 : kind == 1 ? 2 : 1; }
// The first row of a kind.
__device__ constexpr int stencil_start(uint kind) { return kind < 3 ? 8 * kind : kind < 5 ? 9 * kind - 2 : 43; }

// Where the force of the spring of a kind is whose first end is at a row and column of the tile.
__device__ __forceinline__ int stencil_place(uint kind, int row, int column) {
    return (stencil_start(kind) + stencil_rows(kind) + row) * FORCE_STRIDE + HALO + column;
}

// A spring that reaches into the tile: first end, how far the second is from there, place of the force, and kind.
struct StencilOuter {
    uint packed;

    // That of a thread, if it has one, in a tile whose rows are so many entries apart.
    template <uint STRIDE = TILE_STRIDE> __device__ __forceinline__ static StencilOuter of_thread() {
        int lane = (int)(threadIdx.x & 31);
        uint kind = STENCIL_KINDS;
        int row = -1, column = lane;
        switch (threadIdx.x / 32) {
        case 0: kind = 3; break;
        case 1: kind = 2; column = lane + 1; break;
        case 2: kind = 4; column = lane - 1; break;
        case 3: kind = 5; break;
        case 4: kind = 5; row = -2; break;
        case 5:
            if (lane < 16) {
                kind = 1;
                row = lane / 2;
                column = lane % 2 - 2;
            } else if (lane < 24) {
                kind = 0;
                row = lane - 16;
                column = -1;
            }
            break;
        case 6:
            if (lane < 7) {
                kind = 2;
                row = lane;
                column = TILE_COLUMNS;
            } else if (lane < 14) {
                kind = 4;
                row = lane - 7;
                column = -1;
            }
            break;
        }
        if (kind == STENCIL_KINDS) return {0xffffffffu};
        uint first = (uint)((row + HALO) * (int)STRIDE + column + HALO);
        uint further = stencil_rows(kind) * STRIDE + stencil_columns(kind);
        return {first | further << 10 | (uint)stencil_place(kind, row, column) << 17 | kind << 28};
    }
    __device__ __forceinline__ bool exists() const { return packed != 0xffffffffu; }
    __device__ __forceinline__ uint first() const { return packed & 1023u; }
    __device__ __forceinline__ uint second() const { return first() + (packed >> 10 & 127u); }
    __device__ __forceinline__ uint place() const { return packed >> 17 & 2047u; }
    __device__ __forceinline__ uint kind() const { return packed >> 28; }
};

template <bool PLAIN>
__device__ __forceinline__ Spring stencil_spring(const Solver& s, uint kind, const vec3& xi, const vec3& vi, const vec3& xj, const vec3& vj) {
    return spring_at<PLAIN>({s.stencil[kind][0], s.stencil[kind][1], s.stencil[kind][2], nullptr}, xi, vi, xj, vj);
}

// Of so many forces in shared memory, the one at a place; the first two components of all lie before the third ones.
template <int COUNT> __device__ __forceinline__ void force_store(real* forces, int place, const vec3& force) {
    ((real2*)forces)[place] = {force.x, force.y};
    forces[2 * COUNT + place] = force.z;
}

template <int COUNT> __device__ __forceinline__ vec3 force_load(const real* forces, int place) {
    real2 pair = ((const real2*)forces)[place];
    return {pair.x, pair.y, forces[2 * COUNT + place]};
}

// Computes the springs of the thread: those from the particle at an entry of the tile to later ones, and the outer one.
// `PLAIN` says that no length needs care. Gives the square of the shortest.
template <bool PLAIN, uint STRIDE>
__device__ __forceinline__ real stencil_springs_of(
    const Solver& s, const real4* x, const real4* v, uint at, int place, const StencilOuter& outer, real* forces, vec3* own
) {
    vec3 xi = xyz(x[at]), vi = xyz(v[at]);
    real least = REAL_MAX;
#pragma unroll
    for (uint kind = 0; kind < STENCIL_KINDS; kind++) {
        uint j = at + stencil_rows(kind) * STRIDE + stencil_columns(kind);
        Spring spring = stencil_spring<PLAIN>(s, kind, xi, vi, xyz(x[j]), xyz(v[j]));
        own[kind] = spring.force();
        force_store<STENCIL_FORCES>(forces, place + stencil_place(kind, 0, 0), own[kind]);
        least = fmin(spring.length_squared, least);
    }
    if (outer.exists()) {
        uint i = outer.first(), j = outer.second();
        Spring spring = stencil_spring<PLAIN>(s, outer.kind(), xyz(x[i]), xyz(v[i]), xyz(x[j]), xyz(v[j]));
        force_store<STENCIL_FORCES>(forces, outer.place(), spring.force());
        least = fmin(spring.length_squared, least);
    }
    return least;
}

// The same for the particle at a row and column of a tile whose rows are so many entries apart, once more where a length needs care.
template <uint STRIDE = TILE_STRIDE>
__device__ __forceinline__ void stencil_springs(
    const Solver& s, const real4* x, const real4* v, uint row, uint column, const StencilOuter& outer, real* forces, vec3* own
) {
    uint at = (row + HALO) * STRIDE + column + HALO;
    int place = row * FORCE_STRIDE + column;
    real least = stencil_springs_of<true, STRIDE>(s, x, v, at, place, outer, forces, own);
#if !defined(CLOTH_FAST) && !defined(CLOTH_F64)
    if (least < ROOT_PLAIN_MIN) stencil_springs_of<false, STRIDE>(s, x, v, at, place, outer, forces, own);
#endif
}

// Which springs a particle of the patch has: bit 5 - k that of kind k to an earlier one, bit 6 + k that to a later one.
__device__ __forceinline__ uint stencil_mask(const Solver& s, uint row, uint column) {
    uint mask = 0;
#pragma unroll
    for (uint kind = 0; kind < STENCIL_KINDS; kind++) {
        uint rows = stencil_rows(kind), columns = stencil_columns(kind);
        if (row >= rows && column - columns < s.columns) mask |= 1u << (5 - kind);
        if (row + rows < s.rows && column + columns < s.columns) mask |= 1u << (6 + kind);
    }
    return mask;
}

// Whether all particles of a tile have all springs.
__device__ __forceinline__ bool stencil_is_inside(const Solver& s, uint row, uint column) {
    return row >= HALO && column >= HALO && row + TILE_ROWS + HALO <= s.rows && column + TILE_COLUMNS + HALO <= s.columns;
}

// Adds the forces of the springs of a particle at a row and column of the tile, ascending. `own` are those that its thread
// has computed, or null.
template <bool INSIDE, bool HAS_OWN>
__device__ __forceinline__ vec3 stencil_sum(const real* forces, uint row, uint column, uint mask, const vec3* own, vec3 force) {
#pragma unroll
    for (uint k = 0; k < STENCIL_KINDS; k++) {
        uint kind = STENCIL_KINDS - 1 - k;
        int place = stencil_place(kind, (int)row - stencil_rows(kind), (int)column - stencil_columns(kind));
        if (INSIDE || mask >> k & 1) force = force - force_load<STENCIL_FORCES>(forces, place);
    }
#pragma unroll
    for (uint kind = 0; kind < STENCIL_KINDS; kind++) {
        if (!INSIDE && !(mask >> (6 + kind) & 1)) continue;
        force = force + (HAS_OWN ? own[kind] : force_load<STENCIL_FORCES>(forces, stencil_place(kind, row, column)));
    }
    return force;
}
