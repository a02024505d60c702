// NUMERICS section 7: sums of what colliders did, over blocks of 512 particles, in a tree of fixed shape. What is
// summed starts again from zero. Block number 6 (c b + k) + q is for block k of b, collider c and component q.

#define BLOCK 512

extern "C" __global__ void __launch_bounds__(512) collider_impulses(const __grid_constant__ Solver s, uint blocks, double* sums) {
    __shared__ double values[BLOCK];
    uint component = blockIdx.x % 6, block = blockIdx.x / 6 % blocks, collider = blockIdx.x / 6 / blocks;
    uint i = block * BLOCK + threadIdx.x;
    double own = 0;
    if (i < s.count) {
        double* place = s.collider_impulses + (size_t)(6 * collider + component) * s.count + i;
        own = *place;
        *place = 0;
    }
    values[threadIdx.x] = own;
    for (uint half = BLOCK / 2; half > 0; half /= 2) {
        __syncthreads();
        if (threadIdx.x < half) values[threadIdx.x] += values[threadIdx.x + half];
    }
    if (threadIdx.x == 0) sums[blockIdx.x] = values[0];
}
