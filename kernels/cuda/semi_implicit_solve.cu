// NUMERICS section 6, `semi_implicit_solve`: the right-hand side of the constant system, which the kernel of the conjugate gradient
// method then solves.

extern "C" __global__ void semi_implicit_solve(const __grid_constant__ Solver s, const __grid_constant__ Linear l, real length) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    const real4* v = s.velocity[s.present];
    vec3 own = xyz(v[i]), sum = {0, 0, 0};
    SpringRow row = spring_row(s, i);
    for (uint k = 0; k < row.count; k++) {
        uint2 entry = spring_entry(s, row, k);
        sum = sum + s.spring_kinds[entry.y].y * (xyz(v[i + entry.x]) - own);
    }
    vec3 right_side = length * xyz(s.force[i]) + length * length * sum;
    if (!(s.position[s.present][i].w > 0)) right_side = {0, 0, 0};
    l.vectors[RIGHT_SIDE][i] = with_w(right_side, 0);
}
