// NUMERICS section 5, `preconditioner_apply`.

extern "C" __global__ void preconditioner_apply(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint from, uint to) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    l.vectors[to][i] = with_w(filtered(s, l, i, preconditioned(l, i, xyz(l.vectors[from][i]))), 0);
}
