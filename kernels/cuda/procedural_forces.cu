// NUMERICS section 3, `procedural_forces`.

extern "C" __global__ void procedural_forces(const __grid_constant__ Solver s, uint number) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    real4 x = s.position[s.present][i], v = s.velocity[s.present][i];
    s.force[i] = with_w(procedural_force(s.substeps[number], i, xyz(x), xyz(v), v.w, xyz(s.force[i])), 0);
}
