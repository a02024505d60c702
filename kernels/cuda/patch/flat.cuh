// NUMERICS section 8: tiles of a regular patch in which nothing touches, which can be seen from their edges alone.
//
// An edge joins neighbours along a row or a column. Take two directions at right angles, one for each. If all edges between two
// particles, on a way along one row and one column, get on by at least FLAT_ALONG contact distances in their own direction, and by
// at most FLAT_ACROSS in the other, particles that are a columns and b rows apart have a distance of at least a FLAT_ALONG - b
// FLAT_ACROSS in the one, and b FLAT_ALONG - a FLAT_ACROSS in the other: more than one in all, unless a spring joins them, whose
// length is looked at.
//
// The way from a particle of a tile to one of the tiles around it stays in the four at a corner. These share the mean of their
// directions; each looks at its own edges in its own ones, and asks for as much more as they differ. What is farther away is known
// from the list of groups: a tile is alone if it names none but those of the tiles around it.

#define FLAT_ALONG ((real)0.8)
#define FLAT_ACROSS ((real)0.43)
// How far an edge of a tile may get on along its own direction, in rest lengths.
#define FLAT_STRETCH ((real)1.5)
// How far at right angles to both of its directions, in contact distances: as far as leaves the others so much room.
#define FLAT_OFF_MOST ((real)1.6)
#define FLAT_ALONG_MOST ((real)1.05)
#define FLAT_ACROSS_LEAST ((real)0.2)

// Tiles by their numbers, row by row, and the groups of their particles.
#define TILE_GROUPS (TILE_COLUMNS * TILE_ROWS / GROUP)

__device__ __forceinline__ uint tiles_across(const Solver& s) { return (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS; }
__device__ __forceinline__ uint tiles_down(const Solver& s) { return (s.rows + TILE_ROWS - 1) / TILE_ROWS; }

// Tile number `around` of the nine of a tile and those around it, NONE where the patch ends.
__device__ __forceinline__ uint tile_around(const Solver& s, uint tile, uint around) {
    uint across = tiles_across(s);
    uint column = tile % across + around % 3 - 1, row = tile / across + around / 3 - 1;
    return column < across && row < tiles_down(s) ? row * across + column : NONE;
}

// What edges of a tile have to be like.
struct TileFlat {
    // Directions of columns and of rows, and the normal.
    vec3 directions[3];
    real along;
    real across;
    real off;
    bool is_alone;

    static constexpr uint WORDS = 3;

    __device__ __forceinline__ static real part(const vec3& edge, const vec3& a) { return fma(edge.x, a.x, fma(edge.y, a.y, edge.z * a.z)); }

    __device__ __forceinline__ static TileFlat load(const real4* words) {
        return {{xyz(words[0]), xyz(words[1]), xyz(words[2])}, words[0].w, words[1].w, absolute(words[2].w), words[2].w > 0};
    }
    __device__ __forceinline__ static real along_most(const Solver& s) { return FLAT_STRETCH * maximum(s.stencil[0][0], s.stencil[3][0]); }
    // Of an edge of columns (0) or of rows (1). Not bound to how a product is rounded; written so that what is not a number is not
    // flat.
    __device__ __forceinline__ bool holds(const Solver& s, uint which, const vec3& edge) const {
        real own = part(edge, directions[which]);
        return (own >= along) & (own <= along_most(s)) & (absolute(part(edge, directions[1 - which])) <= across)
            & (absolute(part(edge, directions[2])) <= off);
    }
    // The same where all share the directions: then it does not matter how long an edge is, nor how far it is off them.
    __device__ __forceinline__ bool holds_shared(const Solver& s, uint which, const vec3& edge) const {
        return (part(edge, directions[which]) >= along) & (absolute(part(edge, directions[1 - which])) <= across);
    }
};

// Roughly one divided by the square root, for what has a margin.
__device__ __forceinline__ real inverse_root(real a) {
#ifdef CLOTH_F64
    return (real)1 / root(a);
#else
    return root_inverse_rough(a);
#endif
}

// Two directions at right angles, equally far from two given ones.
__device__ __forceinline__ void directions_part(vec3& a, vec3& b) {
    a = a * inverse_root(dot(a, a));
    b = b * inverse_root(dot(b, b));
    vec3 sum = a + b, difference = a - b;
    sum = sum * ((real)0.70710678 * inverse_root(dot(sum, sum)));
    difference = difference * ((real)0.70710678 * inverse_root(dot(difference, difference)));
    a = sum + difference;
    b = sum - difference;
}

// Puts a tile among those that are searched in a substep.
__device__ __forceinline__ void tile_search(const Solver& s, uint tile, uint substep, uint tick) {
    if (atomicExch(&s.tile_marks[tile], tick) != tick) s.tile_list[atomicAdd(&s.status->searched[substep % 3], 1u)] = tile;
}

// Where a group of a patch finds the particles of others: among all, and the regions of the list around them.
struct GroupsOfPatch {
    const Solver& s;
    const real4* x;

    __device__ __forceinline__ static void place(const Solver& s, uint group, uint lane, uint& row, uint& column) {
        uint tile = group / TILE_GROUPS, part = group % TILE_GROUPS, across = tiles_across(s);
        column = tile % across * TILE_COLUMNS + part % 4 * 8 + lane % 8;
        row = tile / across * TILE_ROWS + part / 4 * 4 + lane / 8;
    }
    __device__ __forceinline__ real4 position(uint group, uint lane) const {
        uint row, column;
        place(s, group, lane, row, column);
        uint i = row * s.columns + column;
        if (column < s.columns && row < s.rows) return with_w(xyz(x[i]), number_pack(i));
        return {REAL_MAX, REAL_MAX, REAL_MAX, number_pack(NONE)};
    }
    __device__ __forceinline__ Box box(uint group) const { return box_load(s.group_regions, group); }
    __device__ __forceinline__ Box box_now(uint, const real4& position) const {
        return warp_box(number_unpack(position.w) != NONE, xyz(position), xyz(position));
    }
};
