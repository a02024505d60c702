// The precision of the solver, and arithmetic that rounds as the CPU's does.

typedef unsigned int uint;
typedef unsigned long long ulong;

#ifdef CLOTH_F64
typedef double real;
#define REAL_MAX 1.7976931348623157e308
#define REAL_EPSILON 2.220446049250313e-16
#define REAL_MIN_POSITIVE 2.2250738585072014e-308
#else
typedef float real;
#define REAL_MAX 3.40282346638528859812e38f
#define REAL_EPSILON 1.1920928955078125e-7f
#define REAL_MIN_POSITIVE 1.17549435082228750797e-38f
#endif

#define LENGTH_MIN ((real)1e-18)
// Pairs closer than this square [m^2] have no normal.
#define LENGTH_SQUARED_MIN ((real)1e-14)

struct __align__(16) real4 {
    real x, y, z, w;
};

struct __align__(2 * sizeof(real)) real2 {
    real x, y;
};

struct vec3 {
    real x, y, z;
};

__device__ __forceinline__ vec3 make_vec3(real x, real y, real z) { return {x, y, z}; }
__device__ __forceinline__ vec3 xyz(const real4& a) { return {a.x, a.y, a.z}; }
__device__ __forceinline__ real4 with_w(const vec3& a, real w) { return {a.x, a.y, a.z, w}; }
__device__ __forceinline__ vec3 operator+(const vec3& a, const vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
__device__ __forceinline__ vec3 operator-(const vec3& a, const vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
__device__ __forceinline__ vec3 operator*(real s, const vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
__device__ __forceinline__ vec3 operator*(const vec3& a, real s) { return {a.x * s, a.y * s, a.z * s}; }
__device__ __forceinline__ real component(const vec3& a, uint k) { return k == 0 ? a.x : k == 1 ? a.y : a.z; }
// (a.x b.x + a.y b.y) + a.z b.z
__device__ __forceinline__ real dot(const vec3& a, const vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
__device__ __forceinline__ vec3 cross(const vec3& a, const vec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// The second number if the first is NaN.
__device__ __forceinline__ real maximum(real a, real b) { return a > b ? a : b; }
__device__ __forceinline__ real minimum(real a, real b) { return a < b ? a : b; }
#ifdef CLOTH_F64
__device__ __forceinline__ real root(real a) { return sqrt(a); }
__device__ __forceinline__ real absolute(real a) { return fabs(a); }
#else
__device__ __forceinline__ real root(real a) { return sqrtf(a); }
__device__ __forceinline__ real absolute(real a) { return fabsf(a); }
#endif
#ifndef CLOTH_F64
// The correctly rounded square root of a finite number that is not negative, without the branch to a slow path
// that the compiler's has, so that the springs of a loop can overlap: an approximation corrected by one
// step of Newton's method, small numbers scaled into the range in which that is exact.
__device__ __forceinline__ float root_in_line(float a) {
    bool is_small = a < 7.88860905e-31f;
    float scaled = is_small ? a * 18446744073709551616.0f : a;
    // Zero has a root of zero, whatever multiplies it.
    float r = root_inverse_rough(fmaxf(scaled, 1e-31f));
    float guess = __fmul_rn(scaled, r);
    float error = __fmaf_rn(-guess, guess, scaled);
    float exact = __fmaf_rn(error, __fmul_rn(r, 0.5f), guess);
    exact = is_small ? exact * 2.32830643653869628906e-10f : exact;
    return exact;
}

// The same for a number that is not so small that it has to be scaled: from ROOT_PLAIN_MIN on.
#define ROOT_PLAIN_MIN 7.88860905e-31f
__device__ __forceinline__ float root_plain(float a) {
    float r = root_inverse_rough(a);
    float guess = __fmul_rn(a, r);
    float error = __fmaf_rn(-guess, guess, a);
    return __fmaf_rn(error, __fmul_rn(r, 0.5f), guess);
}

// The correctly rounded reciprocal of a number between 1e-18 and 1e37, in the same way.
__device__ __forceinline__ float reciprocal_in_line(float a) {
    float r = inverse_rough(a);
    float error = __fmaf_rn(-a, r, 1.0f);
    return __fmaf_rn(r, error, r);
}
#endif

// Written so that NaN is not finite.
__device__ __forceinline__ bool is_finite(const vec3& a) {
    return absolute(a.x) <= REAL_MAX && absolute(a.y) <= REAL_MAX && absolute(a.z) <= REAL_MAX;
}
