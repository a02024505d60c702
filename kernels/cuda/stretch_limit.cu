// NUMERICS section 4, `stretch_limit`: the triangles of fabric of one colour, no two of which share a particle.

extern "C" __global__ void stretch_limit(const __grid_constant__ Solver s, uint first, uint count, real length, ulong step) {
    uint k = blockIdx.x * blockDim.x + threadIdx.x;
    if (k >= count || s.status->non_finite_step <= step) return;
    triangle_limit(s.position[s.present], s.velocity[s.present], s.membranes[s.stretch_triangles[first + k]], s.stretch_ratio, length);
}

// All sweeps over springs and triangles, with resident blocks.
extern "C" __global__ void strain_limit_sweeps(const __grid_constant__ Solver s, real length, ulong step) {
    bool stopped = s.status->non_finite_step <= step;
    Motion motion = {s.position[s.present], s.velocity[s.present]};
    colours_limit(s, motion, length, stopped, [&] { grid_barrier(&s.status->barrier[0]); });
}
