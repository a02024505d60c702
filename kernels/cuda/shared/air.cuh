// NUMERICS section 3: pressure and friction of the air, pressure of gas within a cloth.

#define THIRD ((real)(1.0 / 3.0))

// The air relative to a triangle.
struct Flow {
    // Twice the area along the normal [m^2].
    vec3 doubled;
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
    flow.doubled = doubled;
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

// A sixth of the pressure of the gas within a cloth at a time [Pa].
__device__ __forceinline__ real gas_sixth(const Solver& s, uint cloth, real time) {
    const real* gas = s.gas + 3 * cloth;
    real start = gas[1], end = gas[2];
    real share = time >= end ? (real)1 : time <= start ? (real)0 : (time - start) / (end - start);
    return gas[0] * share;
}

// A third of the force on a triangle [N], that of the air and that of the gas within the cloth.
__device__ __forceinline__ vec3 air_share(const Solver& s, const Motion& motion, const uint4& corners, const SubstepData& substep) {
    Flow flow = flow_at(motion, corners, substep.wind);
    real pressure = s.air[2 * corners.w];
    real friction = s.air[2 * corners.w + 1];
    vec3 n = flow.normal, t = flow.along;
    vec3 force = {
        pressure * absolute(flow.across) * flow.across * n.x + friction * flow.speed * t.x,
        pressure * absolute(flow.across) * flow.across * n.y + friction * flow.speed * t.y,
        pressure * absolute(flow.across) * flow.across * n.z + friction * flow.speed * t.z,
    };
    vec3 share = {flow.area * force.x * THIRD, flow.area * force.y * THIRD, flow.area * force.z * THIRD};
    if (s.gas == nullptr) return share;
    return share + gas_sixth(s, corners.w, substep.time) * flow.doubled;
}

// The force of air and gas on a particle [N], its triangles in ascending order.
__device__ __forceinline__ vec3 air_force(const Solver& s, const Motion& motion, uint particle, const SubstepData& substep) {
    vec3 sum = {0, 0, 0};
    uint end = s.triangle_rows[particle + 1];
    // So that the corners of the next are on their way.
#pragma unroll 2
    for (uint at = s.triangle_rows[particle]; at < end; at++) {
        sum = sum + air_share(s, motion, s.triangles[at], substep);
    }
    return sum;
}
