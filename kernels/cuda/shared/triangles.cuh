// NUMERICS section 15: contact of triangles. What kernels are told, the surface, boxes, and the list of pairs.

// As `contact::device::PairTask`.
struct PairTask {
    // Pairs belong to the list that are not this far apart along the same axis at both sets of positions [m].
    real reach;
    // Time for which particles are followed [s].
    real length;
    // Distance of features at the end of their ways [m].
    real delta;
    // Distance below which pairs may touch [m].
    real distance;
    // Sum of the TASK_ constants.
    uint flags;
    // Groups of triangles, a power of two: those of cloths, and behind them those of bodies.
    uint group_count;
    uint pair_count;
    // Room for pairs in the list, and for those that are found.
    uint pair_capacity;
    uint found_capacity;
    // Blocks of `contact_pairs_moved` for each end of the ways.
    uint moved_blocks;
    uint edge_count;
    // Particles, and nodes of bodies behind them.
    uint node_count;
    // Groups of cloths: two triangles of bodies are no pair.
    uint own_group_count;
    // Where the pairs of this task begin in the list: those of marked particles stand behind those of all.
    uint pair_first;
};

// Only pairs with a marked particle are looked at, and listed: for the present ways, not for the two sets of positions.
#define TASK_MARKED 1u
// Pairs that do not move are looked at as well.
#define TASK_NEW 2u

// The features of two triangles: four particles, then the numbers of the features, the first of these with EDGES if they are edges. Otherwise the
// first is a vertex and the second a triangle.
struct FeaturePair {
    uint particles[4];
    uint first, second;
};

#define EDGES 0x80000000u
#define FEATURE_PAIRS_MAX 0x10000000u

// A box with sides along the axes.
struct Bounds {
    vec3 low, high;
};

// Around what features or triangles are at both sets of positions.
struct WayBounds {
    Bounds first, second;
};

// All memory of contact of triangles, the second argument of its kernels.
struct TrianglePairs {
    PairTask task;
    // Eight words for each place in a group: the number of its triangle, NO_TRIANGLE at the end of the last groups; its corners; a bit for
    // each corner and then for each edge that belongs to it; its edges. Behind all of them two words for each edge, its particles, and for each
    // node whom seams make it one with.
    const uint* surface;
    // Starts of the ways, then ends; w is not 0 if the particle is marked.
    real4* ways;
    // Both sets of positions that the list was made for.
    real4* references;
    // Around triangles in the order of their groups, then around the nodes of a binary tree over the groups, a heap: the children of
    // node k are 2 k and 2 k + 1, and groups are its last nodes.
    WayBounds* boxes;
    FeaturePair* list;
    // Pairs that were found, and pairs in the list, even where there was no room for them.
    uint* counts;
    FeaturePair* found;
    // MOVED_NUMBERS for each block of `contact_pairs_moved`.
    real* moved;
};

static_assert(sizeof(TrianglePairs) == 4 * sizeof(real) + 10 * 4 + 8 * 8, "`triangle_contact.rs` of the backend has another layout");

#define NO_TRIANGLE 0xffffffffu
// Triangles of a group.
#define SLOTS 8u

__device__ __forceinline__ bool pair_is_edges(const FeaturePair& pair) { return (pair.first & EDGES) != 0; }

__device__ __forceinline__ uint triangle_word(const TrianglePairs& t, uint slot, uint word) { return t.surface[8 * (size_t)slot + word]; }

__device__ __forceinline__ const uint* edge_ends(const TrianglePairs& t, uint edge) {
    return t.surface + 8 * (size_t)SLOTS * t.task.group_count + 2 * (size_t)edge;
}

__device__ __forceinline__ uint seam_class(const TrianglePairs& t, uint particle) {
    return t.surface[8 * (size_t)SLOTS * t.task.group_count + 2 * (size_t)t.task.edge_count + particle];
}

__device__ __forceinline__ Bounds bounds_none() {
    return {{(real)REAL_MAX, (real)REAL_MAX, (real)REAL_MAX}, {-(real)REAL_MAX, -(real)REAL_MAX, -(real)REAL_MAX}};
}


__device__ __forceinline__ vec3 least(const vec3& a, const vec3& b) { return {minimum(a.x, b.x), minimum(a.y, b.y), minimum(a.z, b.z)}; }
__device__ __forceinline__ vec3 largest(const vec3& a, const vec3& b) { return {maximum(a.x, b.x), maximum(a.y, b.y), maximum(a.z, b.z)}; }

__device__ __forceinline__ Bounds bounds_with(const Bounds& bounds, const vec3& point) {
    return {least(bounds.low, point), largest(bounds.high, point)};
}

__device__ __forceinline__ Bounds bounds_union(const Bounds& a, const Bounds& b) { return {least(a.low, b.low), largest(a.high, b.high)}; }

// Whether along some axis they are `reach` or more apart.
__device__ __forceinline__ bool bounds_are_apart(const Bounds& a, const Bounds& b, real reach) {
    return a.low.x - b.high.x >= reach || b.low.x - a.high.x >= reach || a.low.y - b.high.y >= reach || b.low.y - a.high.y >= reach ||
           a.low.z - b.high.z >= reach || b.low.z - a.high.z >= reach;
}

__device__ __forceinline__ WayBounds ways_none() { return {bounds_none(), bounds_none()}; }

__device__ __forceinline__ bool ways_are_empty(const WayBounds& bounds) { return bounds.first.low.x > bounds.first.high.x; }

__device__ __forceinline__ WayBounds ways_with(const TrianglePairs& t, const WayBounds& bounds, uint node) {
    const real4* sets = t.task.flags & TASK_MARKED ? t.ways : t.references;
    return {bounds_with(bounds.first, xyz(sets[node])), bounds_with(bounds.second, xyz(sets[(size_t)t.task.node_count + node]))};
}

__device__ __forceinline__ WayBounds ways_union(const WayBounds& a, const WayBounds& b) {
    return {bounds_union(a.first, b.first), bounds_union(a.second, b.second)};
}

// Whether along some axis, on the same side of it at both sets, they are `reach` or more apart: then they are so all the way from one to the
// other, however far both go together.
__device__ __forceinline__ bool ways_are_apart(const WayBounds& a, const WayBounds& b, real reach) {
    bool apart = false;
    for (uint axis = 0; axis < 3; axis++) {
        bool above = component(a.first.low, axis) - component(b.first.high, axis) >= reach;
        bool below = component(b.first.low, axis) - component(a.first.high, axis) >= reach;
        above &= component(a.second.low, axis) - component(b.second.high, axis) >= reach;
        below &= component(b.second.low, axis) - component(a.second.high, axis) >= reach;
        apart |= above | below;
    }
    return apart;
}

__device__ __forceinline__ uint node_place(const TrianglePairs& t, uint node) { return SLOTS * t.task.group_count + node; }

// Hands a pair to the host. The order in which they come has no meaning.
__device__ __forceinline__ void pair_found(const TrianglePairs& t, const FeaturePair& pair) {
    uint number = atomicAdd(&t.counts[0], 1u);
    if (number < t.task.found_capacity) t.found[number] = pair;
}
