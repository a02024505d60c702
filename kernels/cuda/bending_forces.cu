// NUMERICS section 12, `bending_forces`: the state of each fold, what patches ask of them, the forces of each fold, their sums.
// In implicit steps they are impulses [N s], and no sums are taken here.

extern "C" __global__ void bending_forces_folds(const __grid_constant__ Solver s) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number < s.fold_count) fold_state_store(s, present_motion(s), number);
}

extern "C" __global__ void bending_forces_moments(const __grid_constant__ Solver s, real still, real moving, real ahead) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number < s.element_count) fold_moments_store(s, number, still, moving, ahead);
}

extern "C" __global__ void bending_forces(const __grid_constant__ Solver s) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number < s.fold_count) fold_force_store(s, number);
}

extern "C" __global__ void bending_forces_gather(const __grid_constant__ Solver s) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    s.force[i] = with_w(xyz(s.force[i]) + bending_force(s, i), 0);
}
