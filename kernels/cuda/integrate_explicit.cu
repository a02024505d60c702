// NUMERICS section 4, `integrate_explicit`.

extern "C" __global__ void integrate_explicit(const __grid_constant__ Solver s, real length) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    real4 x = s.position[s.present][i];
    real4 v = s.velocity[s.present][i];
    Moved moved = integrate(length, x.w, xyz(s.force[i]), xyz(x), xyz(v));
    s.position[1 - s.present][i] = with_w(moved.position, x.w);
    s.velocity[1 - s.present][i] = with_w(moved.velocity, v.w);
}
