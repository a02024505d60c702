// NUMERICS section 11, `membrane_forces`: the forces of every triangle, then their sums.

extern "C" __global__ void membrane_forces(const __grid_constant__ Solver s) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number < s.element_count) membrane_force_store(s, present_motion(s), number);
}

extern "C" __global__ void membrane_forces_gather(const __grid_constant__ Solver s) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    s.force[i] = with_w(xyz(s.force[i]) + membrane_force(s, i), 0);
}
