// NUMERICS section 12, `bending_linearise`: the tangent and the impulses of the folds of every triangle of fabric.

extern "C" __global__ void bending_linearise(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint from_start) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number < s.element_count) bending_tangent_store(s, l, present_motion(s), number, from_start != 0);
}
