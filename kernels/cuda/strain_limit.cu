// NUMERICS section 4, `strain_limit`: the springs of one colour, no two of which share a particle.

extern "C" __global__ void strain_limit(const __grid_constant__ Solver s, uint first, uint count, real length, ulong step) {
    uint k = blockIdx.x * blockDim.x + threadIdx.x;
    if (k >= count || s.status->non_finite_step <= step) return;
    spring_limit(s.position[s.present], s.velocity[s.present], s.limited_springs[first + k], s.longest, length);
}
