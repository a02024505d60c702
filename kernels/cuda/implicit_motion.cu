// NUMERICS section 5: `velocity_add`, `position_advance`, `position_from_kept`, `state_restore`.

extern "C" __global__ void velocity_add(const __grid_constant__ Solver s, const __grid_constant__ Linear l, real scale) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    real4 v = s.velocity[s.present][i];
    s.velocity[s.present][i] = with_w(xyz(v) + scale * xyz(l.vectors[SOLUTION][i]), v.w);
}

extern "C" __global__ void position_advance(const __grid_constant__ Solver s, real length, uint from_kept) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    real4 x = s.position[s.present][i];
    vec3 start = from_kept ? xyz(s.kept_position[i]) : xyz(x);
    if (!(from_kept && length == 0)) start = start + length * xyz(s.velocity[s.present][i]);
    s.position[s.present][i] = with_w(start, x.w);
}

extern "C" __global__ void state_restore(const __grid_constant__ Solver s) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    s.position[s.present][i] = with_w(xyz(s.kept_position[i]), s.position[s.present][i].w);
    s.velocity[s.present][i] = with_w(xyz(s.kept_velocity[i]), s.velocity[s.present][i].w);
}
