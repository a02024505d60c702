// NUMERICS section 11: triangles of fabric that stretch and shear. All operations are those of the CPU in their order.

// A tensile curve: slope at rest, coefficient of E^3 [N/m], the strain at which it ends.
struct TensileCurve {
    real linear;
    real cubic;
    real end;
};

// How threads jam: the strain at which they begin to, that from there to the largest one, the coefficient of the stress [N/m].
struct Locking {
    real onset;
    real range;
    real rise;
};

// What a cloth is made of: curves of warp and weft, c and G [N/m], damping of stretching [s].
struct FabricLaw {
    TensileCurve curves[2];
    real coupling;
    real shear;
    real damping;
    Locking lock;
};

// A triangle that stretches: corners, law, D_m^-1 by rows [1/m], area [m^2].
struct MembraneTriangle {
    uint particles[3];
    uint fabric;
    real inverse[4];
    real area;
};

// a s + b t
__device__ __forceinline__ vec3 combination(const vec3& a, real s, const vec3& b, real t) {
    return {a.x * s + b.x * t, a.y * s + b.y * t, a.z * s + b.z * t};
}

__device__ __forceinline__ vec3 minus(const vec3& a) { return {-a.x, -a.y, -a.z}; }

// Energy per area, stress and slope of a curve at a strain.
struct CurveAt {
    real energy;
    real stress;
    real slope;
};

__device__ __forceinline__ CurveAt curve_at(const TensileCurve& curve, real strain) {
    real x = minimum(maximum(strain, (real)0), curve.end);
    real beyond = maximum(strain - curve.end, (real)0);
    real x2 = x * x;
    real steep = curve.cubic * x2;
    CurveAt at;
    at.slope = curve.linear + (real)3 * steep;
    at.stress = curve.linear * strain + steep * (x + (real)3 * beyond);
    real bent = (real)0.25 * x2 + beyond * (x + (real)1.5 * beyond);
    at.energy = (real)0.5 * curve.linear * strain * strain + steep * bent;
    return at;
}

__device__ __forceinline__ CurveAt locking_at(const Locking& lock, real strain) {
    real y = maximum(strain - lock.onset, (real)0);
    real x = minimum(y, lock.range);
    real beyond = y - x;
    real steep = lock.rise * x;
    CurveAt at;
    at.stress = steep * (x + (beyond + beyond));
    at.energy = steep * ((real)(1.0 / 3.0) * (x * x) + beyond * (x + beyond));
    at.slope = steep + steep;
    return at;
}

// F: its columns f_u and f_v, or their rates.
struct Gradient {
    vec3 u;
    vec3 v;
};

// A symmetric tensor of the plane: strain E11, E22, E12 or stress S11, S22, S12 [N/m].
struct Plane {
    real uu;
    real vv;
    real uv;
};

__device__ __forceinline__ Plane operator+(const Plane& a, const Plane& b) { return {a.uu + b.uu, a.vv + b.vv, a.uv + b.uv}; }

__device__ __forceinline__ Gradient deformation(const vec3* corners, const MembraneTriangle& t) {
    vec3 a = corners[1] - corners[0], b = corners[2] - corners[0];
    return {combination(a, t.inverse[0], b, t.inverse[2]), combination(a, t.inverse[1], b, t.inverse[3])};
}

__device__ __forceinline__ Plane green_strain(const Gradient& f) {
    real half = (real)0.5;
    return {half * (dot(f.u, f.u) - (real)1), half * (dot(f.v, f.v) - (real)1), half * dot(f.u, f.v)};
}

__device__ __forceinline__ Plane green_strain_rate(const Gradient& f, const Gradient& rate) {
    return {dot(f.u, rate.u), dot(f.v, rate.v), (real)0.5 * (dot(f.u, rate.v) + dot(f.v, rate.u))};
}

// Stress, slopes dS11/dE11, dS22/dE22, dS12/(2 dE12) [N/m] and energy per area [J/m^2] at a strain.
struct FabricResponse {
    Plane stress;
    real slope_u;
    real slope_v;
    real slope_shear;
    real energy;
};

__device__ __forceinline__ FabricResponse fabric_response(const FabricLaw& law, const Plane& e) {
    CurveAt u = curve_at(law.curves[0], e.uu), v = curve_at(law.curves[1], e.vv);
    real shear = (real)2 * law.shear * e.uv;
    CurveAt lock_u = locking_at(law.lock, e.uu), lock_v = locking_at(law.lock, e.vv), lock_w = locking_at(law.lock, absolute(e.uv));
    real across = e.uv < 0 ? -lock_w.stress : lock_w.stress;
    real locked = lock_u.energy + lock_v.energy + (real)2 * lock_w.energy;
    FabricResponse response;
    response.stress = {(u.stress + law.coupling * e.vv) + lock_u.stress, (v.stress + law.coupling * e.uu) + lock_v.stress, shear + across};
    response.slope_u = u.slope + lock_u.slope;
    response.slope_v = v.slope + lock_v.slope;
    response.slope_shear = law.shear + (real)0.5 * lock_w.slope;
    response.energy = (u.energy + v.energy + law.coupling * e.uu * e.vv + shear * e.uv) + locked;
    return response;
}

// `damping` times C times a rate of strain.
__device__ __forceinline__ Plane viscous_stress(const FabricLaw& law, const FabricResponse& response, const Plane& rate, real damping) {
    return {
        damping * (response.slope_u * rate.uu + law.coupling * rate.vv),
        damping * (response.slope_v * rate.vv + law.coupling * rate.uu),
        damping * ((real)2 * response.slope_shear * rate.uv),
    };
}

// Forces on the three corners for a stress: f_a = -A F S grad phi_a.
__device__ __forceinline__ void membrane_corners(const Gradient& f, const Plane& stress, const MembraneTriangle& t, real area, vec3* forces) {
    vec3 pull_u = combination(f.u, stress.uu, f.v, stress.uv) * -area;
    vec3 pull_v = combination(f.u, stress.uv, f.v, stress.vv) * -area;
    forces[1] = combination(pull_u, t.inverse[0], pull_v, t.inverse[1]);
    forces[2] = combination(pull_u, t.inverse[2], pull_v, t.inverse[3]);
    forces[0] = minus(forces[1] + forces[2]);
}

// Positions or velocities of some particles.
template <uint COUNT> __device__ __forceinline__ void vectors_load(const real4* from, const uint (&particles)[COUNT], vec3* to) {
#pragma unroll
    for (uint k = 0; k < COUNT; k++) to[k] = xyz(from[particles[k]]);
}

// `membrane_forces` of one triangle.
__device__ __forceinline__ void membrane_force_store(const Solver& s, const Motion& motion, uint number) {
    MembraneTriangle t = s.membranes[number];
    const FabricLaw& law = s.fabric_laws[t.fabric];
    vec3 x[3];
    vectors_load(motion.x, t.particles, x);
    Gradient f = deformation(x, t);
    FabricResponse response = fabric_response(law, green_strain(f));
    Plane stress = response.stress;
    if (law.damping > 0) {
        vec3 v[3];
        vectors_load(motion.v, t.particles, v);
        stress = stress + viscous_stress(law, response, green_strain_rate(f, deformation(v, t)), law.damping);
    }
    vec3 forces[3];
    membrane_corners(f, stress, t, t.area, forces);
#pragma unroll
    for (uint k = 0; k < 3; k++) s.membrane_forces[3 * (size_t)number + k] = with_w(forces[k], 0);
}

// The sum of what triangles put at a particle, in their order.
__device__ __forceinline__ vec3 fabric_gather(const uint* rows, const uint* entries, const real4* vectors, uint particle) {
    vec3 sum = {0, 0, 0};
    uint end = rows[particle + 1];
#pragma unroll 6
    for (uint at = rows[particle]; at < end; at++) sum = sum + xyz(vectors[entries[at]]);
    return sum;
}

__device__ __forceinline__ vec3 membrane_force(const Solver& s, uint particle) {
    return fabric_gather(s.membrane_rows, s.membrane_entries, s.membrane_forces, particle);
}
