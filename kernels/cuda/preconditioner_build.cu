// NUMERICS section 5, `preconditioner_build`: the diagonal, or 3 x 3 blocks.

__device__ __forceinline__ real reciprocal(real value) { return value > 0 ? (real)1 / value : (real)0; }

// The inverse of a block, made safe against rounding by 4 eps of its trace. From its Cholesky factors.
__device__ void invert(vec3& on, vec3& off) {
    real trace = on.x + on.y + on.z;
    real safety = (real)4 * (real)REAL_EPSILON * trace;
    real smallest = maximum(safety, (real)1e-30);
    real a = root(maximum(on.x + safety, smallest));
    real a_inverse = (real)1 / a;
    real b = off.x * a_inverse;
    real c = off.y * a_inverse;
    real d = root(maximum(on.y + safety - b * b, smallest));
    real d_inverse = (real)1 / d;
    real e = (off.z - b * c) * d_inverse;
    real f_inverse = (real)1 / root(maximum(on.z + safety - c * c - e * e, smallest));
    real p = a_inverse;
    real q = -(b * p) * d_inverse;
    real r = -(c * p + e * q) * f_inverse;
    real s = d_inverse;
    real t = -(e * s) * f_inverse;
    real w = f_inverse;
    real exists = trace > 0 ? (real)1 : (real)0;
    on = {exists * (p * p + q * q + r * r), exists * (s * s + t * t), exists * (w * w)};
    off = {exists * (q * s + r * t), exists * (r * w), exists * (t * w)};
}

// S D S + tr(D) (I - S).
__device__ void restrict_to(vec3& on, vec3& off, const vec3& filter_on, const vec3& filter_off) {
    real d[3][3] = {{on.x, off.x, off.y}, {off.x, on.y, off.z}, {off.y, off.z, on.z}};
    real s[3][3] = {
        {filter_on.x, filter_off.x, filter_off.y},
        {filter_off.x, filter_on.y, filter_off.z},
        {filter_off.y, filter_off.z, filter_on.z},
    };
    real trace = on.x + on.y + on.z;
    real sd[3][3], sds[3][3];
    for (uint r = 0; r < 3; r++)
        for (uint c = 0; c < 3; c++) {
            sd[r][c] = 0;
            for (uint k = 0; k < 3; k++) sd[r][c] += s[r][k] * d[k][c];
        }
    for (uint r = 0; r < 3; r++)
        for (uint c = 0; c < 3; c++) {
            sds[r][c] = 0;
            for (uint k = 0; k < 3; k++) sds[r][c] += sd[r][k] * s[k][c];
        }
    on = {
        sds[0][0] + trace * ((real)1 - s[0][0]),
        sds[1][1] + trace * ((real)1 - s[1][1]),
        sds[2][2] + trace * ((real)1 - s[2][2]),
    };
    off = {
        sds[0][1] + trace * ((real)0 - s[0][1]),
        sds[0][2] + trace * ((real)0 - s[0][2]),
        sds[1][2] + trace * ((real)0 - s[1][2]),
    };
}

extern "C" __global__ void preconditioner_build(const __grid_constant__ Solver s, const __grid_constant__ Linear l) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    vec3 on = xyz(l.diagonal[0][i]), off = xyz(l.diagonal[1][i]);
    if (l.has_constraints && l.touch_counts[i] > 0) restrict_to(on, off, xyz(l.filter[0][i]), xyz(l.filter[1][i]));
    if (l.has_blocks) {
        invert(on, off);
        l.inverse[1][i] = with_w(off, 0);
    } else {
        on = {reciprocal(on.x), reciprocal(on.y), reciprocal(on.z)};
    }
    l.inverse[0][i] = with_w(on, 0);
}
