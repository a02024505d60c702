// NUMERICS section 5, `matrix_apply`.

extern "C" __global__ void matrix_apply(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint from, uint to) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    l.vectors[to][i] = with_w(matrix_row<1, false>(s, l, l.vectors[from], i, l.origin[i]), 0);
}
