// NUMERICS section 3: gravity, uniform fields, drag.

__device__ __forceinline__ vec3 field_force(const Solver& s, real mass, const vec3& v) {
    return {
        mass * (s.acceleration[0] - s.drag_rate[0] * v.x),
        mass * (s.acceleration[1] - s.drag_rate[1] * v.y),
        mass * (s.acceleration[2] - s.drag_rate[2] * v.z),
    };
}
