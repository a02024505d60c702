// NUMERICS section 4: one spring that is too long (`strain_limit`), one triangle of fabric (`stretch_limit`), and the sweeps over all of them.

// How far both ends of a spring are moved.
struct LimitShift {
    vec3 a;
    vec3 b;
};

// Says whether the spring between two particles with inverse masses `wa` and `wb` is longer than it may be, and what to do then.
__device__ __forceinline__ bool limit_shift(const vec3& a, real wa, const vec3& b, real wb, real longest, LimitShift& shift) {
    vec3 d = b - a;
    real distance = root(dot(d, d));
    real total = wa + wb;
    if (distance <= longest || total == 0) return false;
    real scale = (distance - longest) / total / distance;
    vec3 both = scale * d;
    shift.a = wa * both;
    shift.b = (-wb) * both;
    return true;
}

// The velocity of a particle that is moved in a substep of so much time.
__device__ __forceinline__ real4 limit_velocity(const real4& v, const vec3& shift, real length) {
    return {v.x + shift.x / length, v.y + shift.y / length, v.z + shift.z / length, v.w};
}

// A spring with its two particles and its kind, in place.
__device__ __forceinline__ void spring_limit(real4* x, real4* v, const uint4& spring, const real* longest, real length) {
    real4 a = x[spring.x], b = x[spring.y];
    LimitShift shift;
    if (!limit_shift(xyz(a), a.w, xyz(b), b.w, longest[spring.z], shift)) return;
    x[spring.x] = with_w(xyz(a) + shift.a, a.w);
    x[spring.y] = with_w(xyz(b) + shift.b, b.w);
    v[spring.x] = limit_velocity(v[spring.x], shift.a, length);
    v[spring.y] = limit_velocity(v[spring.y], shift.b, length);
}

// Share of the largest inverse mass with which a direction of a triangle counts at least.
#define STRETCH_LEAST_SHARE 0.1

// Says whether a principal stretch of the triangle with corners `x` and inverse masses `w` is above `ratio`, and how the corners move then.
__device__ __forceinline__ bool stretch_shift(const vec3* x, const real* w, const MembraneTriangle& t, real ratio, vec3* shift) {
    Gradient f = deformation(x, t);
    real c11 = dot(f.u, f.u), c22 = dot(f.v, f.v), c12 = dot(f.u, f.v);
    real half = (real)0.5;
    real mean = half * (c11 + c22), apart = half * (c11 - c22);
    real radius = root(apart * apart + c12 * c12);
    real longest = ratio * ratio;
    if (mean + radius <= longest) return false;
    // Of two forms of the eigenvector the one that does not cancel.
    real du = apart >= 0 ? radius + apart : c12, dv = apart >= 0 ? c12 : radius - apart;
    real length = root(du * du + dv * dv);
    du = length > 0 ? du / length : (real)1;
    dv = length > 0 ? dv / length : (real)0;
    real largest = maximum(maximum(w[0], w[1]), w[2]);
    shift[0] = shift[1] = shift[2] = make_vec3(0, 0, 0);
#pragma unroll 1
    for (uint direction = 0; direction < 2; direction++) {
        real square = direction == 0 ? mean + radius : mean - radius;
        if (square > longest || !(square <= longest)) {
            real stretch = root(square);
            vec3 along = combination(f.u, du, f.v, dv);
            real p[3] = {
                -(t.inverse[0] + t.inverse[2]) * du + -(t.inverse[1] + t.inverse[3]) * dv,
                t.inverse[0] * du + t.inverse[1] * dv,
                t.inverse[2] * du + t.inverse[3] * dv,
            };
            real q[3] = {p[0] * p[0], p[1] * p[1], p[2] * p[2]};
            real own = w[0] * q[0] + w[1] * q[1] + w[2] * q[2];
            real total = maximum(own, (real)STRETCH_LEAST_SHARE * (largest * (q[0] + q[1] + q[2])));
            if (!(total <= 0)) {
                real scale = (stretch - ratio) / total / stretch;
#pragma unroll
                for (uint a = 0; a < 3; a++) shift[a] = shift[a] + minus((w[a] * (scale * p[a])) * along);
            }
        }
        real turned = -dv;
        dv = du;
        du = turned;
    }
    return true;
}

// A triangle, in place.
__device__ __forceinline__ void triangle_limit(real4* x, real4* v, const MembraneTriangle& t, real ratio, real length) {
    vec3 corners[3], shift[3];
    real w[3];
#pragma unroll
    for (uint a = 0; a < 3; a++) {
        real4 at = x[t.particles[a]];
        corners[a] = xyz(at);
        w[a] = at.w;
    }
    if (!stretch_shift(corners, w, t, ratio, shift)) return;
#pragma unroll
    for (uint a = 0; a < 3; a++) {
        x[t.particles[a]] = with_w(corners[a] + shift[a], w[a]);
        v[t.particles[a]] = limit_velocity(v[t.particles[a]], shift[a], length);
    }
}

// All sweeps, one colour after the other, in place: springs, then triangles. Blocks meet after each colour.
template <typename Meet>
__device__ __forceinline__ void colours_limit(const Solver& s, const Motion& motion, real length, bool stopped, Meet meet) {
    real4* x = (real4*)motion.x;
    real4* v = (real4*)motion.v;
    uint first = blockIdx.x * blockDim.x + threadIdx.x, step = gridDim.x * blockDim.x;
    for (uint sweep = 0; sweep < s.limit_sweeps; sweep++) {
        for (uint colour = 0; colour < s.limit_colours; colour++) {
            uint end = s.limited_rows[colour + 1];
            for (uint k = s.limited_rows[colour] + first; k < end && !stopped; k += step) {
                spring_limit(x, v, s.limited_springs[k], s.longest, length);
            }
            meet();
        }
        for (uint colour = 0; colour < s.stretch_colours; colour++) {
            uint end = s.stretch_rows[colour + 1];
            for (uint k = s.stretch_rows[colour] + first; k < end && !stopped; k += step) {
                triangle_limit(x, v, s.membranes[s.stretch_triangles[k]], s.stretch_ratio, length);
            }
            meet();
        }
    }
}
