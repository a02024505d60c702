// NUMERICS section 5, `vector_fill`: the same value in every particle.

extern "C" __global__ void vector_fill(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint to, real x, real y, real z) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i < s.count) l.vectors[to][i] = {x, y, z, 0};
}
