// NUMERICS section 6, `semi_implicit_factorise`: the constant matrix W, in the form of that of section 5: a spring has u = 0 and
// its weight as e. The blocks of triangles of fabric are there already.

// The least mass of a particle, as a share of the sum of its springs and triangles.
#define MASS_SHARE_MIN ((real)1e-12)

extern "C" __global__ void semi_implicit_factorise(const __grid_constant__ Solver s, const __grid_constant__ Linear l) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    along_write(s, l, i);
    if (i >= s.count) return;
    real of_fabric = l.has_elements ? l.element_sums[i].x : (real)0;
    real step = l.length, weights = of_fabric;
    SpringRow row = spring_row(s, i);
    for (uint k = 0; k < row.count; k++) {
        uint at = row.first + (k << row.shift);
        uint2 entry = s.spring_entries[at];
        SpringKind kind = spring_kind(s, entry.y);
        real weight = step * step * kind.stiffness + step * kind.damping;
        weights += weight;
        if ((int)entry.x > 0) factors_write(l, factor_place(s, l, l.links[at].y, i, i + entry.x), 0, weight);
    }
    real mass = maximum(s.velocity[s.present][i].w, MASS_SHARE_MIN * weights);
    real4 zero = {0, 0, 0, 0};
    l.origin[i] = {0, 0, 0, s.position[s.present][i].w};
    l.base[0][i] = {mass, mass, mass, 0};
    l.base[1][i] = zero;
    l.diagonal[0][i] = {mass + weights, mass + weights, mass + weights, 0};
    l.diagonal[1][i] = zero;
    // Colliders constrain nothing here.
    if (l.has_constraints) l.touch_counts[i] = 0;
}
