// NUMERICS section 5, `vector_dot`: the sum of each block of 512 particles; the host adds them in order.

extern "C" __global__ void __launch_bounds__(SUM_BLOCK) vector_dot(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint a, uint b) {
    __shared__ SumMemory<SUM_BLOCK> memory;
    uint i = blockIdx.x * SUM_BLOCK + threadIdx.x;
    real product = 0;
    if (i < s.count) product = dot(xyz(l.vectors[a][i]), xyz(l.vectors[b][i]));
    memory.put(0, 0, product);
    __syncthreads();
    memory.finish(1, 1, l.partials, l.partials, blockIdx.x, 0);
}
