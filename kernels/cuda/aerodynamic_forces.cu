// NUMERICS section 3, `aerodynamic_forces`.

extern "C" __global__ void aerodynamic_forces(const __grid_constant__ Solver s, uint number) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    s.force[i] = with_w(xyz(s.force[i]) + air_force(s, present_motion(s), i, s.substeps[number]), 0);
}
