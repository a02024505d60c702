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

// Boxes around the nodes of the tree, by one block, level by level.
extern "C" __global__ void __launch_bounds__(1024) contact_pairs_tree(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    for (uint first = t.task.group_count / 2; first > 0; first /= 2) {
        for (uint node = first + threadIdx.x; node < 2 * first; node += blockDim.x) {
            t.boxes[node_place(t, node)] = ways_union(t.boxes[node_place(t, 2 * node)], t.boxes[node_place(t, 2 * node + 1)]);
        }
        __syncthreads();
    }
}

__device__ __forceinline__ void pair_note(const Solver& s, const TrianglePairs& t, const FeaturePair& pair) {
    const uint* p = pair.particles;
    uint middle = pair_is_edges(pair) ? 2 : 1;
    WayBounds first = ways_none(), second = ways_none();
    for (uint k = 0; k < 4; k++) {
        WayBounds& bounds = k < middle ? first : second;
        bounds = ways_with(t, bounds, p[k]);
    }
    // Beyond what any list has, counting goes on no further: the number could wrap.
    if (ways_are_apart(first, second, t.task.reach) || *(volatile uint*)&t.counts[1] > FEATURE_PAIRS_MAX) return;
    uint number = atomicAdd(&t.counts[1], 1u);
    if (number < t.task.pair_capacity) t.list[number] = pair;
}

// Whether a feature of so many corners has a particle, or one that a seam makes one with it.
__device__ __forceinline__ bool has_particle(const TrianglePairs& t, const uint* corners, uint count, uint particle) {
    uint own = seam_class(t, particle);
    for (uint k = 0; k < count; k++) {
        if (seam_class(t, corners[k]) == own) return true;
    }
    return false;
}

// The pairs of what belongs to two triangles, less those that share a particle.
__device__ __forceinline__ void triangles_compare(const Solver& s, const TrianglePairs& t, uint a, uint b) {
    uint of_a[3], of_b[3];
    for (uint k = 0; k < 3; k++) {
        of_a[k] = triangle_word(t, a, 1 + k);
        of_b[k] = triangle_word(t, b, 1 + k);
    }
    uint owned_a = triangle_word(t, a, 4), owned_b = triangle_word(t, b, 4);
    for (uint k = 0; k < 3; k++) {
        if ((owned_a >> k & 1) && !has_particle(t, of_b, 3, of_a[k])) {
            pair_note(s, t, {{of_a[k], of_b[0], of_b[1], of_b[2]}, of_a[k], triangle_word(t, b, 0)});
        }
        if ((owned_b >> k & 1) && !has_particle(t, of_a, 3, of_b[k])) {
            pair_note(s, t, {{of_b[k], of_a[0], of_a[1], of_a[2]}, of_b[k], triangle_word(t, a, 0)});
        }
    }
    if (owned_a >> 3 == 0 || owned_b >> 3 == 0) return;
    for (uint k = 0; k < 3; k++) {
        if (!(owned_a >> (3 + k) & 1)) continue;
        for (uint l = 0; l < 3; l++) {
            if (!(owned_b >> (3 + l) & 1)) continue;
            uint edge_a = triangle_word(t, a, 5 + k), edge_b = triangle_word(t, b, 5 + l);
            uint first = min(edge_a, edge_b), second = max(edge_a, edge_b);
            const uint* p = edge_ends(t, first);
            const uint* q = edge_ends(t, second);
            if (has_particle(t, p, 2, q[0]) || has_particle(t, p, 2, q[1])) continue;
            pair_note(s, t, {{p[0], p[1], q[0], q[1]}, first | EDGES, second});
        }
    }
}


// The last group below a node.
__device__ __forceinline__ uint last_group(uint node, uint count) {
    while (node < count) node = 2 * node + 1;
    return node - count;
}

// All pairs of features whose boxes are not the reach apart, a thread for each triangle of cloths and place in the groups that it meets:
// threads side by side go the same way through the tree. The order of pairs has no meaning.
extern "C" __global__ void contact_pairs_list(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    uint thread = blockIdx.x * blockDim.x + threadIdx.x;
    uint slot = thread / SLOTS, place = thread % SLOTS;
    uint count = t.task.group_count, group = slot / SLOTS;
    if (group >= t.task.own_group_count || triangle_word(t, slot, 0) == NO_TRIANGLE) return;
    WayBounds own = t.boxes[slot];
    // One node of each level waits at most, and the root.
    uint waiting[34];
    uint depth = 1;
    waiting[0] = 1;
    while (depth > 0) {
        uint node = waiting[--depth];
        WayBounds bounds = t.boxes[node_place(t, node)];
        if (ways_are_empty(bounds) || ways_are_apart(own, bounds, t.task.reach)) continue;
        if (node >= count) {
            // Each two triangles once.
            uint other = SLOTS * (node - count) + place;
            if (other > slot && triangle_word(t, other, 0) != NO_TRIANGLE && !ways_are_apart(own, t.boxes[other], t.task.reach)) {
                triangles_compare(s, t, slot, other);
            }
            continue;
        }
        if (last_group(2 * node + 1, count) >= group) waiting[depth++] = 2 * node + 1;
        if (last_group(2 * node, count) >= group) waiting[depth++] = 2 * node;
    }
}
