// NUMERICS section 15, `contact_certify`: the pairs of the list of which nothing proves that their features do not meet.

extern "C" __global__ void contact_certify(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number >= t.task.pair_count) return;
    FeaturePair pair = t.list[t.task.pair_first + number];
    Points start, end;
    bool is_marked = false, rests = true;
    for (uint k = 0; k < 4; k++) {
        real4 way = t.ways[(size_t)t.task.node_count + pair.particles[k]];
        vec3 a = start.x[k] = xyz(t.ways[pair.particles[k]]);
        vec3 b = end.x[k] = xyz(way);
        is_marked |= way.w != 0;
        rests &= a.x == b.x && a.y == b.y && a.z == b.z;
    }
    if ((t.task.flags & TASK_MARKED) && !is_marked) return;
    // What does not move stays as it is, which needs no proof unless it is new.
    if (!(t.task.flags & TASK_NEW) && rests) return;
    if (!is_proven(start, end, pair_is_edges(pair), t.task.delta)) pair_found(t, pair);
}
