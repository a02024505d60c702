// NUMERICS section 12: triangles of fabric that resist curvature, as the folds around them tell it. All operations are those of the CPU in their order.

// Folds of a patch.
#define PATCH_FOLDS 9
// Places of patches that a fold can have.
#define FOLD_PLACES_MAX 6

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

// What a patch makes of its folds, by its number: for each fold [rad] the three numbers [J^(1/2)] half the sum of whose squares is the energy;
// damping of bending [s]. Numbers of one meaning are side by side for all patches.
struct Plate {
    const real* numbers;
    uint stride;

    __device__ __forceinline__ real map(uint row, uint fold) const { return numbers[(size_t)(row * PATCH_FOLDS + fold) * stride]; }

    __device__ __forceinline__ real damping() const { return numbers[(size_t)(3 * PATCH_FOLDS) * stride]; }
};

__device__ __forceinline__ Plate plate_of(const Solver& s, uint number) { return {s.plates + number, s.element_count}; }

// Those three numbers, for folds that are `still` times as far from rest as they are, and `moving` times their rates.
__device__ __forceinline__ Plane energy_roots(const Solver& s, uint number, const Plate& plate, real still, real moving) {
    Plane sum = {0, 0, 0};
#pragma unroll
    for (uint k = 0; k < PATCH_FOLDS; k++) {
        // Behind the last fold is one that does not fold, for those that are not there.
        real2 state = s.fold_states[s.patch_folds[(size_t)k * s.element_count + number]];
        real bent = still * state.x + moving * state.y;
        sum = {sum.uu + plate.map(0, k) * bent, sum.vv + plate.map(1, k) * bent, sum.uv + plate.map(2, k) * bent};
    }
    return sum;
}

// `bending_forces`, the first part: how far a fold is from rest [rad], how fast it folds [rad/s], and of what its derivatives consist.
__device__ __forceinline__ void fold_state_store(const Solver& s, const Motion& motion, uint number) {
    uint4 at = s.fold_particles[number];
    Fold fold = fold_of(xyz(motion.x[at.x]), xyz(motion.x[at.y]), xyz(motion.x[at.z]), xyz(motion.x[at.w]));
    vec3 g[4];
    fold_gradient(fold, g);
    real rate = dot(g[0], xyz(motion.v[at.x])) + dot(g[1], xyz(motion.v[at.y])) + dot(g[2], xyz(motion.v[at.z])) + dot(g[3], xyz(motion.v[at.w]));
    s.fold_states[number] = {angle_difference(fold.angle, s.fold_angles[number]), rate};
    s.fold_apexes[2 * (size_t)number] = with_w(fold.apex, fold.foot);
    s.fold_apexes[2 * (size_t)number + 1] = with_w(fold.beyond, fold.foot_beyond);
}

// The derivatives of a fold by its vertices, from what the first part has left.
__device__ __forceinline__ void fold_gradient(const Solver& s, uint number, vec3* gradient) {
    real4 apex = s.fold_apexes[2 * (size_t)number], beyond = s.fold_apexes[2 * (size_t)number + 1];
    fold_gradient({0, xyz(apex), xyz(beyond), apex.w, beyond.w}, gradient);
}

// The second part: what a patch asks of its folds. Rates count `moving` times the damping of the patch, and `ahead` more.
__device__ __forceinline__ void fold_moments_store(const Solver& s, uint number, real still, real moving, real ahead) {
    Plate plate = plate_of(s, number);
    Plane roots = energy_roots(s, number, plate, still, moving * plate.damping() + ahead);
#pragma unroll
    for (uint k = 0; k < PATCH_FOLDS; k++) {
        s.fold_moments[(size_t)k * s.element_count + number] = plate.map(0, k) * roots.uu + plate.map(1, k) * roots.vv + plate.map(2, k) * roots.uv;
    }
}

// The third part: what all patches ask of a fold, on its vertices.
__device__ __forceinline__ void fold_force_store(const Solver& s, uint number) {
    // Behind the last place of a fold are those of a zero.
    real sum = 0;
#pragma unroll
    for (uint k = 0; k < FOLD_PLACES_MAX; k++) sum = sum + s.fold_moments[s.moment_places[(size_t)k * s.fold_count + number]];
    vec3 gradient[4];
    fold_gradient(s, number, gradient);
#pragma unroll
    for (uint vertex = 0; vertex < 4; vertex++) s.bending_forces[4 * (size_t)number + vertex] = with_w(gradient[vertex] * -sum, 0);
}

// The last part: the sum at a particle.
__device__ __forceinline__ vec3 bending_force(const Solver& s, uint particle) {
    return fabric_gather(s.fold_rows, s.fold_entries, s.bending_forces, particle);
}
