// NUMERICS section 2, `spring_forces`.

extern "C" __global__ void spring_forces(const __grid_constant__ Solver s) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    Motion motion = present_motion(s);
    vec3 xi = xyz(motion.x[i]), vi = xyz(motion.v[i]);
    vec3 force = xyz(s.force[i]);
    SpringRow row = spring_row(s, i);
    for (uint k = 0; k < row.count; k++) {
        uint2 entry = spring_entry(s, row, k);
        uint j = i + entry.x;
        force = force + spring_at(spring_kind(s, entry.y), xi, vi, xyz(motion.x[j]), xyz(motion.v[j])).force();
    }
    s.force[i] = with_w(force, 0);
}
