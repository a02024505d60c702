// NUMERICS section 9, `vertex_normals`, into the memory of the forces.

extern "C" __global__ void vertex_normals(const __grid_constant__ Solver s, real4* out) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    const real4* x = s.position[s.present];
    vec3 sum = {0, 0, 0};
    uint end = s.triangle_rows[i + 1];
    for (uint at = s.triangle_rows[i]; at < end; at++) {
        uint4 corners = s.triangles[at];
        vec3 a = xyz(x[corners.x]);
        sum = sum + cross(xyz(x[corners.y]) - a, xyz(x[corners.z]) - a);
    }
    real length = root(dot(sum, sum));
    real inverse = length > 0 ? (real)1 / length : (real)0;
    out[i] = with_w(sum * inverse, 0);
}
