// NUMERICS section 11, `membrane_linearise`: the tangent and the impulses of every triangle of fabric.

extern "C" __global__ void membrane_linearise(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint from_start) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number < s.element_count) membrane_tangent_store(s, l, present_motion(s), number, from_start != 0);
}
