// NUMERICS section 8, `contact_forces`: the penalty response; section 15, contact of triangles.

extern "C" __global__ void contact_forces(const __grid_constant__ Solver s) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    Motion motion = present_motion(s);
    vec3 sum;
    uint contacts;
    if (!penalty_force(s, motion, i, xyz(motion.x[i]), xyz(motion.v[i]), sum, contacts)) return;
    s.force[i] = with_w(xyz(s.force[i]) + sum, 0);
}

extern "C" __global__ void contact_forces_triangles(const __grid_constant__ Solver s, const __grid_constant__ ContactTable table) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count || !contacts_any(table, i)) return;
    vec3 sum = {0, 0, 0};
    for (uint k = table.offsets[i], end = table.offsets[i + 1]; k < end; k++) {
        const TriangleContact& contact = table.contacts[table.places[k] / 4];
        sum = sum + contact.weights[table.places[k] % 4] * make_vec3(contact.force[0], contact.force[1], contact.force[2]);
    }
    s.force[i] = with_w(xyz(s.force[i]) + sum, 0);
}
