// NUMERICS section 3, `field_forces`.

extern "C" __global__ void field_forces(const __grid_constant__ Solver s) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    real4 v = s.velocity[s.present][i];
    s.force[i] = with_w(field_force(s, v.w, xyz(v)), 0);
}
