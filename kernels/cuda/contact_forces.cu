// NUMERICS section 8, `contact_forces`: the penalty response.

extern "C" __global__ void contact_forces(const __grid_constant__ Solver s) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    Motion motion = present_motion(s);
    vec3 sum;
    uint contacts;
    if (!penalty_force(s, motion, i, xyz(motion.x[i]), xyz(motion.v[i]), sum, contacts)) return;
    s.force[i] = with_w(xyz(s.force[i]) + sum, 0);
}
