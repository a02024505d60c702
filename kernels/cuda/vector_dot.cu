// NUMERICS section 5, `vector_dot`: the sum of each block of 512 particles; the host adds them in order.

extern "C" __global__ void __launch_bounds__(512) vector_dot(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint a, uint b) {
    __shared__ SumMemory memory;
    uint i = blockIdx.x * SUM_BLOCK + threadIdx.x;
    vec3 p = {0, 0, 0}, q = {0, 0, 0};
    if (i < s.count) {
        p = xyz(l.vectors[a][i]);
        q = xyz(l.vectors[b][i]);
    }
    sum_put(memory, 0, p, q);
    sum_block(memory, 1, &l.partials[blockIdx.x], &l.partials[blockIdx.x]);
}
