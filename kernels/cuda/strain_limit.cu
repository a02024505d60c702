// NUMERICS section 4, `strain_limit`: the springs of one colour, no two of which share a particle.

extern "C" __global__ void strain_limit(const __grid_constant__ Solver s, uint first, uint count, real length, ulong step) {
    uint k = blockIdx.x * blockDim.x + threadIdx.x;
    if (k >= count || s.status->non_finite_step <= step) return;
    uint4 spring = s.limited_springs[first + k];
    real4* x = s.position[s.present];
    real4* v = s.velocity[s.present];
    real4 a = x[spring.x], b = x[spring.y];
    real longest = s.longest[spring.z];
    vec3 d = xyz(b) - xyz(a);
    real distance = root(dot(d, d));
    real total = a.w + b.w;
    if (distance <= longest || total == 0) return;
    real scale = (distance - longest) / total / distance;
    vec3 shift = scale * d;
    real4 u = v[spring.x], w = v[spring.y];
    vec3 change = a.w * shift;
    x[spring.x] = with_w(xyz(a) + change, a.w);
    v[spring.x] = {u.x + change.x / length, u.y + change.y / length, u.z + change.z / length, u.w};
    change = (-b.w) * shift;
    x[spring.y] = with_w(xyz(b) + change, b.w);
    v[spring.y] = {w.x + change.x / length, w.y + change.y / length, w.z + change.z / length, w.w};
}
