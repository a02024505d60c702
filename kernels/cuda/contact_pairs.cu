// NUMERICS section 15, `contact_pairs`: the list of pairs of features that can touch or meet, and what tells whether it is complete.

// Ways from where particles are to where their velocities take them.
extern "C" __global__ void contact_pairs_ahead(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    vec3 x = xyz(s.position[s.present][i]), v = xyz(s.velocity[s.present][i]);
    t.ways[i] = with_w(x, 0);
    t.ways[(size_t)t.task.node_count + i] = with_w(x + t.task.length * v, 0);
}

// Ways from the start of the substep to where particles are.
extern "C" __global__ void contact_pairs_substep(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    t.ways[i] = with_w(xyz(s.start_position[i]), 0);
    t.ways[(size_t)t.task.node_count + i] = with_w(xyz(s.position[s.present][i]), 0);
}

// Threads of a block that makes the tree, and blocks at most.
#define TREE_THREADS 256
#define TREE_BLOCKS 256u
// Threads of a block that lists pairs.
#define LIST_THREADS 128

#define MOVED_NUMBERS 14
#define MOVED_THREADS 128

// How far particles have moved since both sets of positions: for each half, starts and ends of ways, some blocks.
extern "C" __global__ void __launch_bounds__(MOVED_THREADS) contact_pairs_moved(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    __shared__ real moved[MOVED_THREADS][MOVED_NUMBERS];
    uint blocks = t.task.moved_blocks, half = blockIdx.x / blocks, thread = threadIdx.x;
    // Largest numbers of all: ways since the first set, their negatives, the same of the second set, the largest coordinate, and whether something is
    // not finite.
    real own[MOVED_NUMBERS];
    for (uint k = 0; k < MOVED_NUMBERS; k++) own[k] = k < 12 ? -(real)REAL_MAX : (real)0;
    for (uint i = blockIdx.x % blocks * MOVED_THREADS + thread; i < t.task.node_count; i += blocks * MOVED_THREADS) {
        vec3 x = xyz(t.ways[(size_t)half * t.task.node_count + i]);
        if (!is_finite(x)) {
            own[13] = 1;
            continue;
        }
        vec3 a = xyz(t.references[i]), b = xyz(t.references[(size_t)t.task.node_count + i]);
        for (uint axis = 0; axis < 3; axis++) {
            real p = component(x, axis), q = component(a, axis), r = component(b, axis);
            own[axis] = maximum(own[axis], p - q);
            own[3 + axis] = maximum(own[3 + axis], q - p);
            own[6 + axis] = maximum(own[6 + axis], p - r);
            own[9 + axis] = maximum(own[9 + axis], r - p);
            own[12] = maximum(own[12], absolute(p));
        }
    }
    for (uint k = 0; k < MOVED_NUMBERS; k++) moved[thread][k] = own[k];
    for (uint width = MOVED_THREADS / 2; width > 0; width /= 2) {
        __syncthreads();
        if (thread < width) {
            for (uint k = 0; k < MOVED_NUMBERS; k++) moved[thread][k] = maximum(moved[thread][k], moved[thread + width][k]);
        }
    }
    __syncthreads();
    if (thread < MOVED_NUMBERS) t.moved[MOVED_NUMBERS * blockIdx.x + thread] = moved[0][thread];
}

__device__ __forceinline__ void node_fit(const TrianglePairs& t, uint node) {
    t.boxes[node_place(t, node)] = ways_union(t.boxes[node_place(t, 2 * node)], t.boxes[node_place(t, 2 * node + 1)]);
}

// `contact_groups`: boxes around triangles at both sets of positions, and around their groups.
extern "C" __global__ void contact_pairs_boxes(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    uint group = blockIdx.x * blockDim.x + threadIdx.x;
    if (group >= t.task.group_count) return;
    WayBounds around = ways_none();
    for (uint slot = SLOTS * group; slot < SLOTS * (group + 1); slot++) {
        if (triangle_word(t, slot, 0) == NO_TRIANGLE) break;
        WayBounds bounds = ways_none();
        for (uint k = 1; k <= 3; k++) bounds = ways_with(t, bounds, triangle_word(t, slot, k));
        t.boxes[slot] = bounds;
        around = ways_union(around, bounds);
    }
    t.boxes[node_place(t, t.task.group_count + group)] = around;
}

// Boxes around the nodes of the tree: blocks, as many as a power of two, have the nodes below one each, level by level.
extern "C" __global__ void __launch_bounds__(TREE_THREADS) contact_pairs_tree(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    for (uint width = t.task.group_count / 2 / gridDim.x; width > 0; width /= 2) {
        uint first = (gridDim.x + blockIdx.x) * width;
        for (uint node = first + threadIdx.x; node < first + width; node += blockDim.x) node_fit(t, node);
        __syncthreads();
    }
}

// And around those above them, by one block.
extern "C" __global__ void __launch_bounds__(TREE_THREADS) contact_pairs_tree_top(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    for (uint first = min(TREE_BLOCKS, t.task.group_count / 2) / 2; first > 0; first /= 2) {
        for (uint node = first + threadIdx.x; node < 2 * first; node += blockDim.x) node_fit(t, node);
        __syncthreads();
    }
}

// Pairs of two triangles have numbers: the corners of the first, those of the second, three times three edges. A bit for each whose features belong to
// these triangles.
__device__ __forceinline__ uint pairs_owned(const TrianglePairs& t, uint a, uint b) {
    uint of_a = triangle_word(t, a, 4), of_b = triangle_word(t, b, 4);
    uint owned = (of_a & 7) | (of_b & 7) << 3;
    for (uint k = 0; k < 3; k++) owned |= (of_a >> (3 + k) & 1 ? of_b >> 3 & 7 : 0) << (6 + 3 * k);
    return owned;
}

__device__ __forceinline__ FeaturePair pair_between(const TrianglePairs& t, uint a, uint b, uint number) {
    if (number < 6) {
        uint of = number < 3 ? a : b, other = number < 3 ? b : a;
        uint corner = triangle_word(t, of, 1 + number % 3);
        return {{corner, triangle_word(t, other, 1), triangle_word(t, other, 2), triangle_word(t, other, 3)}, corner, triangle_word(t, other, 0)};
    }
    uint edge_a = triangle_word(t, a, 5 + (number - 6) / 3), edge_b = triangle_word(t, b, 5 + (number - 6) % 3);
    uint first = min(edge_a, edge_b), second = max(edge_a, edge_b);
    const uint* p = edge_ends(t, first);
    const uint* q = edge_ends(t, second);
    return {{p[0], p[1], q[0], q[1]}, first | EDGES, second};
}

// Whether the features of a pair are not the reach apart, and share no particle nor what a seam makes one.
__device__ __forceinline__ bool pair_is_near(const TrianglePairs& t, const FeaturePair& pair) {
    const uint* p = pair.particles;
    uint middle = pair_is_edges(pair) ? 2 : 1;
    WayBounds first = ways_none(), second = ways_none();
    for (uint k = 0; k < 4; k++) {
        WayBounds& bounds = k < middle ? first : second;
        bounds = ways_with(t, bounds, p[k]);
    }
    if (ways_are_apart(first, second, t.task.reach)) return false;
    for (uint k = 0; k < middle; k++) {
        uint own = seam_class(t, p[k]);
        for (uint l = middle; l < 4; l++) {
            if (seam_class(t, p[l]) == own) return false;
        }
    }
    return true;
}

// Lists the pairs of two triangles in each lane that has some, by one count for the warp: all warps count in the same place. Returns whether there may
// be more.
__device__ __forceinline__ bool triangles_compare(const TrianglePairs& t, bool has_some, uint2 triangles) {
    uint near = 0, lane = threadIdx.x % WARP;
    for (uint owned = has_some ? pairs_owned(t, triangles.x, triangles.y) : 0; owned != 0; owned &= owned - 1) {
        uint number = __ffs(owned) - 1;
        if (pair_is_near(t, pair_between(t, triangles.x, triangles.y, number))) near |= 1u << number;
    }
    // What lanes before this one have, a bit of their numbers at a time: none has more than 15.
    uint before = 0, all = 0;
    for (uint bit = 0; bit < 4; bit++) {
        uint lanes = __ballot_sync(ALL_LANES, __popc(near) >> bit & 1);
        before += __popc(lanes & ((1u << lane) - 1)) << bit;
        all += __popc(lanes) << bit;
    }
    if (all == 0) return true;
    uint first = lane == 0 ? atomicAdd(&t.counts[1], all) : 0;
    first = __shfl_sync(ALL_LANES, first, 0);
    // Beyond what any list has, counting goes on no further: the number could wrap.
    if (first > FEATURE_PAIRS_MAX) return false;
    for (uint place = t.task.pair_first + first + before; near != 0 && place < t.task.pair_capacity; place++, near &= near - 1) {
        t.list[place] = pair_between(t, triangles.x, triangles.y, __ffs(near) - 1);
    }
    return true;
}

// The last group below a node.
__device__ __forceinline__ uint last_group(uint node, uint count) {
    uint level = __clz(node) - __clz(count);
    return (((node + 1) << level) - 1) - count;
}

__device__ __forceinline__ bool triangle_is_marked(const TrianglePairs& t, uint slot) {
    bool is_marked = false;
    for (uint k = 1; k <= 3; k++) is_marked |= t.ways[(size_t)t.task.node_count + triangle_word(t, slot, k)].w != 0;
    return is_marked;
}

// All pairs of features whose boxes are not the reach apart, a thread for each triangle and place in the groups that it meets:
// threads side by side go the same way through the tree. Two triangles that are near wait until a warp has as many of them as lanes, so that all of it
// compares them. The order of pairs has no meaning.
//
// Each two triangles once, from the first of them; where only pairs with a mark are asked for, from the first that has one.
extern "C" __global__ void __launch_bounds__(LIST_THREADS) contact_pairs_list(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    __shared__ uint2 near_triangles[LIST_THREADS / WARP][2 * WARP];
    uint2* queue = near_triangles[threadIdx.x / WARP];
    uint queued = 0, lane = threadIdx.x % WARP;
    uint thread = blockIdx.x * blockDim.x + threadIdx.x;
    uint slot = thread / SLOTS, place = thread % SLOTS;
    uint count = t.task.group_count, group = slot / SLOTS;
    bool by_marks = t.task.flags & TASK_MARKED;
    bool is_of_body = group >= t.task.own_group_count;
    bool searches = group < (by_marks ? count : t.task.own_group_count) && triangle_word(t, slot, 0) != NO_TRIANGLE;
    searches = searches && !(by_marks && !triangle_is_marked(t, slot));
    WayBounds own = searches ? t.boxes[slot] : ways_none();
    // One node of each level waits at most, and the root.
    uint waiting[34];
    uint depth = searches ? 1 : 0;
    // Two triangles of bodies are no pair: cloths are below the first child of the root.
    waiting[0] = is_of_body ? 2 : 1;
    while (__any_sync(ALL_LANES, depth > 0)) {
        bool is_near = false;
        uint other = 0;
        if (depth > 0) {
            uint node = waiting[--depth];
            WayBounds bounds = t.boxes[node_place(t, node)];
            bool meets = !ways_are_empty(bounds) && !ways_are_apart(own, bounds, t.task.reach);
            if (meets && node < count) {
                if (by_marks || last_group(2 * node + 1, count) >= group) waiting[depth++] = 2 * node + 1;
                if (by_marks || last_group(2 * node, count) >= group) waiting[depth++] = 2 * node;
            } else if (meets) {
                other = SLOTS * (node - count) + place;
                is_near = triangle_word(t, other, 0) != NO_TRIANGLE && !ways_are_apart(own, t.boxes[other], t.task.reach) &&
                          (other > slot || (by_marks && !triangle_is_marked(t, other)));
            }
        }
        uint lanes = __ballot_sync(ALL_LANES, is_near);
        if (is_near) queue[queued + __popc(lanes & ((1u << lane) - 1))] = {slot, other};
        queued += __popc(lanes);
        __syncwarp();
        if (queued < WARP) continue;
        queued -= WARP;
        if (!triangles_compare(t, true, queue[queued + lane])) return;
        __syncwarp();
    }
    triangles_compare(t, lane < queued, queue[lane]);
}
