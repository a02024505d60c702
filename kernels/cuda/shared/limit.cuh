// NUMERICS section 4, `strain_limit`: one spring that is too long.

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
