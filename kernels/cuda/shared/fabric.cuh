// NUMERICS sections 11 and 12: triangles of fabric that stretch, shear and fold. All operations are those of the CPU in their order.

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

// Vertices and folds of a patch.
#define PATCH_VERTICES 12
#define PATCH_FOLDS 9

// The same triangle with the folds that tell its curvature: its corners, the vertices beyond its edges, and those beyond the other edges of these
// neighbours; angles at rest [rad]; k11, k22 and k12 [1/m] for each fold [rad]; A D11, A D22, A D12, 4 A D66 [N m^3]; damping [s].
struct BendingPatch {
    uint particles[PATCH_VERTICES];
    real angles[PATCH_FOLDS];
    real map[3][PATCH_FOLDS];
    real plate[4];
    real damping;
};

#ifdef CLOTH_F64
#define REAL_MIN 2.2250738585072014e-308
// What is left of an angle when it is rounded.
#define ANGLE_REST(angle, rest) ((real)(rest))
#else
#define REAL_MIN 1.17549435082228750797e-38f
#define ANGLE_REST(angle, rest) ((real)((angle) - (double)(real)(angle)))
#endif
#define PI_ANGLE 3.14159265358979323846
#define PI_REST 1.2246467991473532e-16
#define HALF_SLOPE_ANGLE 0.4636476090008061
#define HALF_SLOPE_REST 2.2698777452961687e-17

// a s + b t
__device__ __forceinline__ vec3 combination(const vec3& a, real s, const vec3& b, real t) {
    return {a.x * s + b.x * t, a.y * s + b.y * t, a.z * s + b.z * t};
}

__device__ __forceinline__ vec3 minus(const vec3& a) { return {-a.x, -a.y, -a.z}; }

// atan r = r - r z P(z), z = r^2: P(z).
__device__ __forceinline__ real arctangent_polynomial(real z) {
#ifdef CLOTH_F64
    real sum = 1.6285820115365782e-2;
    sum = -3.6531572744216916e-2 + z * sum;
    sum = 4.9768779946159324e-2 + z * sum;
    sum = -5.8335701337905735e-2 + z * sum;
    sum = 6.661073137387531e-2 + z * sum;
    sum = -7.69187620504483e-2 + z * sum;
    sum = 9.090887133436507e-2 + z * sum;
    sum = -1.1111110405462356e-1 + z * sum;
    sum = 1.4285714272503466e-1 + z * sum;
    sum = -1.9999999999876483e-1 + z * sum;
    return 3.333333333333293e-1 + z * sum;
#else
    real sum = (real)6.1687607318e-2;
    sum = (real)-1.0648017377e-1 + z * sum;
    sum = (real)1.4253635705e-1 + z * sum;
    sum = (real)-1.9999158382e-1 + z * sum;
    return (real)3.3333328366e-1 + z * sum;
#endif
}

// Angle of the direction (x, y) in [-pi, pi]; 0 for x = y = 0. Zeros have no sign.
__device__ __forceinline__ real arctangent2(real y, real x) {
    real ay = absolute(y), ax = absolute(x);
    bool steep = ay > ax;
    real small = steep ? ax : ay, large = steep ? ay : ax;
    real over = small - large, under = small + large;
    real base = (real)(PI_ANGLE / 4), base_rest = ANGLE_REST(PI_ANGLE / 4, PI_REST / 4);
    if (small <= (real)0.4375 * large) {
        over = small;
        under = large;
        base = base_rest = 0;
    } else if (small <= (real)0.6875 * large) {
        over = (real)2 * small - large;
        under = (real)2 * large + small;
        base = (real)HALF_SLOPE_ANGLE;
        base_rest = ANGLE_REST(HALF_SLOPE_ANGLE, HALF_SLOPE_REST);
    }
    real r = under == 0 ? (real)0 : over / under;
    real z = r * r;
    real within = base + ((r - r * (z * arctangent_polynomial(z))) + base_rest);
    real turn = 0, turn_rest = 0;
    if (steep) {
        turn = (real)(PI_ANGLE / 2);
        turn_rest = ANGLE_REST(PI_ANGLE / 2, PI_REST / 2);
    } else if (x < 0) {
        turn = (real)PI_ANGLE;
        turn_rest = ANGLE_REST(PI_ANGLE, PI_REST);
    }
    real with_sign = steep != (x < 0) ? -within : within;
    real angle = turn + (with_sign + turn_rest);
    return y < 0 ? -angle : angle;
}

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
    for (uint k = 0; k < 3; k++) s.membrane_forces[3 * (size_t)number + k] = forces[k];
}

// How far two triangles are folded about their edge, and of what its derivatives by the four vertices consist: those by the third vertices of
// both triangles [1/m], and where the feet of these lie on the edge, 0 at its start and 1 at its end.
struct Fold {
    real angle;
    vec3 apex;
    vec3 beyond;
    real foot;
    real foot_beyond;
};

__device__ __forceinline__ real over(real value, real square) { return value / maximum(square, (real)REAL_MIN); }

__device__ __forceinline__ Fold fold_of(const vec3& x0, const vec3& x1, const vec3& x2, const vec3& x3) {
    vec3 e = x1 - x0, a = x2 - x0, b = x3 - x0;
    vec3 n1 = cross(e, a), n2 = cross(b, e);
    real square = dot(e, e);
    real length = root(square);
    Fold fold;
    fold.angle = arctangent2(length * dot(n1, b), dot(n1, n2));
    fold.apex = n1 * over(length, dot(n1, n1));
    fold.beyond = n2 * over(length, dot(n2, n2));
    fold.foot = over(dot(a, e), square);
    fold.foot_beyond = over(dot(b, e), square);
    return fold;
}

// The derivatives by start and end of the edge, the third vertex and the one beyond [1/m].
__device__ __forceinline__ void fold_gradient(const Fold& fold, vec3* gradient) {
    real w1 = fold.foot, w2 = fold.foot_beyond;
    gradient[0] = combination(fold.apex, w1 - (real)1, fold.beyond, w2 - (real)1);
    gradient[1] = combination(fold.apex, -w1, fold.beyond, -w2);
    gradient[2] = fold.apex;
    gradient[3] = fold.beyond;
}

// The shorter way around from one angle to another.
__device__ __forceinline__ real angle_difference(real angle, real rest_angle) {
    real difference = angle - rest_angle;
    real half = (real)PI_ANGLE, full = (real)(2 * PI_ANGLE);
    return difference > half ? difference - full : difference < -half ? difference + full : difference;
}

// The place in the patch of a vertex of a fold: start and end of the edge, third vertex, the one beyond. Octal digits are those of the folds, the
// first one last: of the edges ab, bc, ca, and for each of these of the triangle beyond, from the edge's start to its apex and from there to its end.
__device__ __forceinline__ constexpr uint fold_place(uint fold, uint vertex) {
    return vertex == 3 ? 3 + fold : (vertex == 0 ? 0524130210u : vertex == 1 ? 0052413021u : 0201201102u) >> 3 * fold & 7;
}

// Positions or velocities of the vertices of a fold.
__device__ __forceinline__ void fold_load(const real4* from, const BendingPatch& patch, uint fold, vec3* to) {
#pragma unroll
    for (uint vertex = 0; vertex < 4; vertex++) to[vertex] = xyz(from[patch.particles[fold_place(fold, vertex)]]);
}

// The curvature for the folds of a patch: `still` times what they are beyond rest, plus `moving` times their rates if `moves`. The folds are
// kept where `folds` points, if anywhere. One fold at a time: nine of them at once would take more registers than there are.
__device__ __forceinline__ Plane curvature_of(const Motion& motion, const BendingPatch& patch, real still, real moving, bool moves, Fold* folds) {
    Plane curvature = {0, 0, 0};
#pragma unroll 1
    for (uint k = 0; k < PATCH_FOLDS; k++) {
        vec3 x[4];
        fold_load(motion.x, patch, k, x);
        Fold fold = fold_of(x[0], x[1], x[2], x[3]);
        real bent = still * angle_difference(fold.angle, patch.angles[k]);
        if (moves) {
            vec3 v[4], g[4];
            fold_load(motion.v, patch, k, v);
            fold_gradient(fold, g);
            bent = bent + moving * (dot(g[0], v[0]) + dot(g[1], v[1]) + dot(g[2], v[2]) + dot(g[3], v[3]));
        }
        if (folds) folds[k] = fold;
        Plane part = {patch.map[0][k] * bent, patch.map[1][k] * bent, patch.map[2][k] * bent};
        curvature = k == 0 ? part : curvature + part;
    }
    return curvature;
}

// The moments of a curvature, times the area [N m^2].
__device__ __forceinline__ Plane plate_moment(const real* plate, const Plane& k) {
    return {plate[0] * k.uu + plate[2] * k.vv, plate[2] * k.uu + plate[1] * k.vv, plate[3] * k.uv};
}

// Adds `share` times the derivatives of a fold to the sums of its vertices.
__device__ __forceinline__ void fold_add(const Fold& fold, uint number, real share, vec3* sums) {
    vec3 gradient[4];
    fold_gradient(fold, gradient);
#pragma unroll
    for (uint vertex = 0; vertex < 4; vertex++) {
        vec3& sum = sums[fold_place(number, vertex)];
        sum = sum + gradient[vertex] * share;
    }
}

// Stores minus the sums of moment times gradient on the vertices, the moments of the folds being those of a curvature.
__device__ __forceinline__ void bending_store(const Solver& s, uint number, const BendingPatch& patch, const Fold* folds, const Plane& curvature) {
    Plane m = plate_moment(patch.plate, curvature);
    vec3 forces[PATCH_VERTICES] = {};
#pragma unroll
    for (uint k = 0; k < PATCH_FOLDS; k++) {
        real moment = patch.map[0][k] * m.uu + patch.map[1][k] * m.vv + patch.map[2][k] * m.uv;
        fold_add(folds[k], k, -moment, forces);
    }
#pragma unroll
    for (uint place = 0; place < PATCH_VERTICES; place++) s.bending_forces[PATCH_VERTICES * (size_t)number + place] = forces[place];
}

// `bending_forces` of one triangle.
__device__ __forceinline__ void bending_force_store(const Solver& s, const Motion& motion, uint number) {
    const BendingPatch& patch = s.patches[number];
    Fold folds[PATCH_FOLDS];
    Plane curvature = curvature_of(motion, patch, 1, patch.damping, patch.damping > 0, folds);
    bending_store(s, number, patch, folds, curvature);
}

// The sum of what triangles put at a particle, in their order.
__device__ __forceinline__ vec3 fabric_gather(const uint* rows, const uint* entries, const vec3* vectors, uint particle) {
    vec3 sum = {0, 0, 0};
    uint end = rows[particle + 1];
#pragma unroll 4
    for (uint at = rows[particle]; at < end; at++) sum = sum + vectors[entries[at]];
    return sum;
}

__device__ __forceinline__ vec3 membrane_force(const Solver& s, uint particle) {
    return fabric_gather(s.membrane_rows, s.membrane_entries, s.membrane_forces, particle);
}

__device__ __forceinline__ vec3 bending_force(const Solver& s, uint particle) {
    return fabric_gather(s.bending_rows, s.bending_entries, s.bending_forces, particle);
}
