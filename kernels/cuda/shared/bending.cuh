// NUMERICS section 12: triangles of fabric that resist curvature, as the folds around them tell it. All operations are those of the CPU in their order.

// Vertices and folds of a patch.
#define PATCH_VERTICES 12
#define PATCH_FOLDS 9
// Places of patches that a fold can have.
#define FOLD_PLACES_MAX 6

// A triangle with the folds that tell its curvature: its corners, the vertices beyond its edges, and those beyond the other edges of these
// neighbours; angles at rest [rad].
struct BendingPatch {
    uint particles[PATCH_VERTICES];
    real angles[PATCH_FOLDS];
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

// What a patch makes of its folds, by its number: k11, k22 and k12 [1/m] for each fold [rad]; A D11, A D22, A D12, 4 A D66 [N m^3]; damping
// of bending [s]. Numbers of one meaning are side by side for all patches.
struct Plate {
    const real* numbers;
    uint stride;

    __device__ __forceinline__ real map(uint row, uint fold) const { return numbers[(size_t)(row * PATCH_FOLDS + fold) * stride]; }

    __device__ __forceinline__ real rigidity(uint k) const { return numbers[(size_t)(3 * PATCH_FOLDS + k) * stride]; }

    __device__ __forceinline__ real damping() const { return numbers[(size_t)(3 * PATCH_FOLDS + 4) * stride]; }

    // The moments of a curvature, times the area [N m^2].
    __device__ __forceinline__ Plane moment(const Plane& k) const {
        real d11 = rigidity(0), d22 = rigidity(1), d12 = rigidity(2);
        return {d11 * k.uu + d12 * k.vv, d12 * k.uu + d22 * k.vv, rigidity(3) * k.uv};
    }

    // What moments ask of a fold [N m].
    __device__ __forceinline__ real fold_moment(uint fold, const Plane& m) const {
        return map(0, fold) * m.uu + map(1, fold) * m.vv + map(2, fold) * m.uv;
    }

    // The curvature with that of one more fold.
    __device__ __forceinline__ Plane curvature_add(const Plane& sum, uint fold, real bent) const {
        Plane part = {map(0, fold) * bent, map(1, fold) * bent, map(2, fold) * bent};
        return fold == 0 ? part : sum + part;
    }
};

__device__ __forceinline__ Plate plate_of(const Solver& s, uint number) { return {s.plates + number, s.element_count}; }

// The curvature for the folds of a patch: `still` times what they are beyond rest, plus `moving` times their rates if `moves`. The folds are
// kept where `folds` points, if anywhere. One fold at a time: nine of them at once would take more registers than there are.
__device__ __forceinline__ Plane curvature_of(const Motion& motion, const BendingPatch& patch, const Plate& plate, real still, real moving, bool moves, Fold* folds) {
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
        curvature = plate.curvature_add(curvature, k, bent);
    }
    return curvature;
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

// `bending_forces`, the first part: how far a fold is from rest [rad], and how fast it folds [rad/s].
__device__ __forceinline__ void fold_state_store(const Solver& s, const Motion& motion, uint number) {
    uint4 at = s.fold_particles[number];
    Fold fold = fold_of(xyz(motion.x[at.x]), xyz(motion.x[at.y]), xyz(motion.x[at.z]), xyz(motion.x[at.w]));
    vec3 g[4];
    fold_gradient(fold, g);
    real rate = dot(g[0], xyz(motion.v[at.x])) + dot(g[1], xyz(motion.v[at.y])) + dot(g[2], xyz(motion.v[at.z])) + dot(g[3], xyz(motion.v[at.w]));
    s.fold_states[number] = {angle_difference(fold.angle, s.fold_angles[number]), rate};
}

// The second part: what a patch asks of its folds.
__device__ __forceinline__ void fold_moments_store(const Solver& s, uint number) {
    Plate plate = plate_of(s, number);
    real damping = plate.damping();
    Plane curvature = {0, 0, 0};
#pragma unroll
    for (uint k = 0; k < PATCH_FOLDS; k++) {
        // Behind the last fold is one that does not fold, for those that are not there.
        real2 state = s.fold_states[s.patch_folds[(size_t)k * s.element_count + number]];
        real bent = damping > 0 ? state.x + damping * state.y : state.x;
        curvature = plate.curvature_add(curvature, k, bent);
    }
    Plane m = plate.moment(curvature);
#pragma unroll
    for (uint k = 0; k < PATCH_FOLDS; k++) s.fold_moments[(size_t)k * s.element_count + number] = plate.fold_moment(k, m);
}

// The third part: what all patches ask of a fold, on its vertices.
__device__ __forceinline__ void fold_force_store(const Solver& s, const Motion& motion, uint number) {
    // Behind the last place of a fold are those of a zero.
    real sum = 0;
#pragma unroll
    for (uint k = 0; k < FOLD_PLACES_MAX; k++) sum = sum + s.fold_moments[s.moment_places[(size_t)k * s.fold_count + number]];
    uint4 at = s.fold_particles[number];
    Fold fold = fold_of(xyz(motion.x[at.x]), xyz(motion.x[at.y]), xyz(motion.x[at.z]), xyz(motion.x[at.w]));
    vec3 gradient[4];
    fold_gradient(fold, gradient);
#pragma unroll
    for (uint vertex = 0; vertex < 4; vertex++) s.bending_forces[4 * (size_t)number + vertex] = with_w(gradient[vertex] * -sum, 0);
}

// The last part: the sum at a particle.
__device__ __forceinline__ vec3 bending_force(const Solver& s, uint particle) {
    return fabric_gather(s.fold_rows, s.fold_entries, s.bending_forces, particle);
}
