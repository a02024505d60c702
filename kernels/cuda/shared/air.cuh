// NUMERICS section 3: pressure and friction of the air.

#define THIRD ((real)(1.0 / 3.0))

// The air relative to a triangle.
struct Flow {
    real area;
    vec3 normal;
    // Velocity along the normal [m/s].
    real across;
    // Velocity in the plane [m/s], and its magnitude.
    vec3 along;
    real speed;
};

__device__ __forceinline__ Flow flow_at(const Motion& motion, const uint4& corners, const real* wind) {
    const real4* x = motion.x;
    const real4* v = motion.v;
    vec3 a = xyz(x[corners.x]), b = xyz(x[corners.y]), c = xyz(x[corners.z]);
    vec3 doubled = cross(b - a, c - a);
    real length = root(dot(doubled, doubled));
    Flow flow;
    flow.area = length * (real)0.5;
    real inverse = (real)1 / maximum(length, LENGTH_MIN);
    flow.normal = doubled * inverse;
    vec3 sum = (xyz(v[corners.x]) + xyz(v[corners.y])) + xyz(v[corners.z]);
    vec3 relative = {wind[0] - sum.x * THIRD, wind[1] - sum.y * THIRD, wind[2] - sum.z * THIRD};
    flow.across = dot(relative, flow.normal);
    flow.along = relative - flow.across * flow.normal;
    flow.speed = root(dot(flow.along, flow.along));
    return flow;
}

// A third of the force on a triangle [N].
__device__ __forceinline__ vec3 air_share(const Solver& s, const Motion& motion, const uint4& corners, const real* wind) {
    Flow flow = flow_at(motion, corners, wind);
    real pressure = s.air[2 * corners.w];
    real friction = s.air[2 * corners.w + 1];
    vec3 n = flow.normal, t = flow.along;
    vec3 force = {
        pressure * absolute(flow.across) * flow.across * n.x + friction * flow.speed * t.x,
        pressure * absolute(flow.across) * flow.across * n.y + friction * flow.speed * t.y,
        pressure * absolute(flow.across) * flow.across * n.z + friction * flow.speed * t.z,
    };
    return {flow.area * force.x * THIRD, flow.area * force.y * THIRD, flow.area * force.z * THIRD};
}

// The force of the air on a particle [N], its triangles in ascending order.
__device__ __forceinline__ vec3 air_force(const Solver& s, const Motion& motion, uint particle, const real* wind) {
    vec3 sum = {0, 0, 0};
    uint end = s.triangle_rows[particle + 1];
    // So that the corners of the next are on their way.
#pragma unroll 2
    for (uint at = s.triangle_rows[particle]; at < end; at++) {
        sum = sum + air_share(s, motion, s.triangles[at], wind);
    }
    return sum;
}
