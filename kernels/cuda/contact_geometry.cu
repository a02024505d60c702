// NUMERICS section 15, `contact_geometry`: the pairs of the list whose features are closer than they touch, by the arithmetic of
// `contact::ContactSurface::contact`. The host decides the rest.

// Weights of the vertex and of the closest point of the triangle (Ericson 2005, 5.1.5).
__device__ __forceinline__ void weights_of_triangle(const Points& x, real* weights) {
    const vec3 &p = x.x[0], &a = x.x[1], &b = x.x[2], &c = x.x[3];
    vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    weights[0] = 1;
    weights[1] = weights[2] = weights[3] = 0;
    real d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) {
        weights[1] = -1;
        return;
    }
    real d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) {
        weights[2] = -1;
        return;
    }
    real vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        real v = d1 / (d1 - d3);
        weights[1] = v - (real)1;
        weights[2] = -v;
        return;
    }
    real d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) {
        weights[3] = -1;
        return;
    }
    real vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        real w = d2 / (d2 - d6);
        weights[1] = w - (real)1;
        weights[3] = -w;
        return;
    }
    real va = d3 * d6 - d5 * d4;
    real along_b = d4 - d3, along_c = d5 - d6;
    if (va <= 0 && along_b >= 0 && along_c >= 0) {
        real w = along_b / (along_b + along_c);
        weights[2] = w - (real)1;
        weights[3] = -w;
        return;
    }
    real sum = va + vb + vc;
    real v = vb / sum, w = vc / sum;
    weights[1] = (v + w) - (real)1;
    weights[2] = -v;
    weights[3] = -w;
}

// Weights of the closest points of two edges, if both lie inside.
__device__ __forceinline__ bool weights_of_edges(const Points& x, real* weights) {
    vec3 u = x.x[1] - x.x[0], v = x.x[3] - x.x[2], r = x.x[0] - x.x[2];
    real uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ur = dot(u, r), vr = dot(v, r);
    real square = uu * vv - uv * uv;
    // Edges that are parallel meet all along: their ends touch them.
    if (square <= (real)1e-4 * (uu * vv)) return false;
    real s = (uv * vr - vv * ur) / square;
    real t = (uu * vr - uv * ur) / square;
    weights[0] = (real)1 - s;
    weights[1] = s;
    weights[2] = t - (real)1;
    weights[3] = -t;
    return s > 0 && s < 1 && t > 0 && t < 1;
}

// Whether a pair may touch with particles at the starts of their ways, and nodes of bodies there or at the ends.
__device__ __forceinline__ bool is_near(const Solver& s, const TrianglePairs& t, const FeaturePair& pair, bool nodes_at_end) {
    bool edges = pair_is_edges(pair);
    Points x;
    Bounds first = bounds_none(), second = bounds_none();
    for (uint k = 0; k < 4; k++) {
        uint at = pair.particles[k];
        x.x[k] = xyz(t.ways[nodes_at_end && at >= s.count ? t.task.node_count + at : at]);
        Bounds& bounds = k < (edges ? 2u : 1u) ? first : second;
        bounds = bounds_with(bounds, x.x[k]);
    }
    if (bounds_are_apart(first, second, t.task.distance)) return false;
    real w[4];
    if (edges) {
        if (!weights_of_edges(x, w)) return false;
    } else {
        weights_of_triangle(x, w);
    }
    vec3 difference = (w[1] * (x.x[1] - x.x[0]) + w[2] * (x.x[2] - x.x[0])) + w[3] * (x.x[3] - x.x[0]);
    return root(dot(difference, difference)) < t.task.distance;
}

extern "C" __global__ void contact_geometry(const __grid_constant__ Solver s, const __grid_constant__ TrianglePairs t) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number >= t.task.pair_count) return;
    FeaturePair pair = t.list[t.task.pair_first + number];
    bool has_node = false;
    for (uint k = 0; k < 4; k++) has_node |= pair.particles[k] >= s.count;
    if (is_near(s, t, pair, false) || (has_node && is_near(s, t, pair, true))) pair_found(t, pair);
}
