// NUMERICS section 5, `constraint_filter`.

extern "C" __global__ void constraint_filter(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint vector) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    l.vectors[vector][i] = with_w(filtered(s, l, i, xyz(l.vectors[vector][i])), 0);
}
