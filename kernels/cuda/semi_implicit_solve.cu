// NUMERICS section 6, `semi_implicit_solve`: the right-hand side of the constant system, which the kernel of the conjugate gradient
// method then solves. `stiffness` is that of triangles of fabric, a number for each of their blocks.

extern "C" __global__ void semi_implicit_solve(const __grid_constant__ Solver s, const __grid_constant__ Linear l, real length, const real* stiffness) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    const real4* v = s.velocity[s.present];
    vec3 own = xyz(v[i]), sum = {0, 0, 0};
    SpringRow row = spring_row(s, i);
    for (uint k = 0; k < row.count; k++) {
        uint2 entry = spring_entry(s, row, k);
        sum = sum + s.spring_kinds[entry.y].y * (xyz(v[i + entry.x]) - own);
    }
    if (l.has_elements) {
        for (uint entry = l.element_slices[i / SLICE], end = l.element_slices[i / SLICE + 1]; entry < end; entry++) {
            uint at = entry * SLICE + i % SLICE, j = l.element_columns[at];
            if (j == NONE) break;
            sum = sum + stiffness[at] * (xyz(v[j]) - own);
        }
    }
    vec3 right_side = length * xyz(s.force[i]) + length * length * sum;
    if (!(s.position[s.present][i].w > 0)) right_side = {0, 0, 0};
    l.vectors[RIGHT_SIDE][i] = with_w(right_side, 0);
}
