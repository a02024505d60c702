// NUMERICS section 2: springs with dampers, gathered for each particle in ascending order of its
// neighbours.

#define C0 (-11.9586330606)
#define C1 (-10.0183502273)
#define C2 (24.9699181050)
#define C3 (-113.252152232)
#define C4 (161.887831573)
#define C5 (-90.9709399871)

__device__ __forceinline__ real buckling_polynomial(real u) {
    return (real)C0 + u * ((real)C1 + u * ((real)C2 + u * ((real)C3 + u * ((real)C4 + u * (real)C5))));
}

__device__ __forceinline__ real buckling_polynomial_derivative(real u) {
    return (real)C1 + u * ((real)(2.0 * C2) + u * ((real)(3.0 * C3) + u * ((real)(4.0 * C4) + u * (real)(5.0 * C5))));
}

__device__ __forceinline__ real buckling_polynomial_mean(real u) {
    return (real)C0
        + u * ((real)(C1 / 2.0) + u * ((real)(C2 / 3.0) + u * ((real)(C3 / 4.0) + u * ((real)(C4 / 5.0) + u * (real)(C5 / 6.0)))));
}

struct SpringRow {
    uint first;
    uint count;
    uint shift;
};

// What is done with the numbers of one spring.
struct SpringKind {
    real rest_length;
    real stiffness;
    real damping;
    const Buckling* buckling;

    __device__ __forceinline__ real compression(real stretch) const {
        return maximum(-(stretch * buckling->inverse_rest_length), (real)0);
    }
    __device__ __forceinline__ real buckled(real compression) const {
        return buckling->force_scale * buckling_polynomial(compression);
    }
    // Elastic tension [N].
    __device__ __forceinline__ real tension(real stretch) const {
        if (buckling == nullptr) return stiffness * stretch;
        return maximum(buckled(compression(stretch)), stiffness * stretch);
    }
    // Its derivative by the length [N/m].
    __device__ __forceinline__ real slope(real stretch) const {
        if (buckling == nullptr) return stiffness;
        real u = compression(stretch);
        if (buckled(u) > stiffness * stretch) {
            real slope = -buckling_polynomial_derivative(u);
            return buckling->force_scale * buckling->inverse_rest_length * slope;
        }
        return stiffness;
    }
    // Twice its elastic energy [J].
    __device__ __forceinline__ real energy_doubled(real stretch) const {
        if (buckling == nullptr) return stiffness * stretch * stretch;
        real u = compression(stretch);
        real energy;
        if (buckled(u) > stiffness * stretch) {
            energy = buckling->force_scale * stretch * buckling_polynomial_mean(u) + buckling->energy_offset;
        } else {
            real offset = u > buckling->stiff_compression ? buckling->stiff_energy : (real)0;
            energy = (real)0.5 * stiffness * stretch * stretch + offset;
        }
        return energy + energy;
    }
};

__device__ __forceinline__ SpringRow spring_row(const Solver& s, uint particle) {
    uint2 header = s.spring_headers[s.spring_row[particle]];
    return {header.x, header.y & 0xffffffu, header.y >> 24};
}

__device__ __forceinline__ uint2 spring_entry(const Solver& s, const SpringRow& row, uint k) {
    uint at = row.first + (k << row.shift);
#ifdef CLOTH_PACKED
    uint packed = s.spring_packed[at];
    return {(uint)(int)(short)(packed & 0xffffu), packed >> 16};
#else
    return s.spring_entries[at];
#endif
}

__device__ __forceinline__ SpringKind spring_kind(const Solver& s, uint kind) {
    real4 numbers = s.spring_kinds[kind];
    const Buckling* buckling = nullptr;
    // The last number is above zero if springs of the kind buckle.
    if (s.can_buckle && numbers.w > 0) buckling = s.spring_buckling + kind;
    return {numbers.x, numbers.y, numbers.z, buckling};
}

struct Spring {
    // From the particle to its neighbour [m].
    vec3 difference;
    real length_squared;
    real length;
    // Length beyond the rest length [m].
    real stretch;
    // Force along the spring [N].
    real tension;
    // 1 / length [1/m], bounded for coinciding particles.
    real inverse_length;

    __device__ __forceinline__ vec3 force() const {
        real scale = tension * inverse_length;
        return scale * difference;
    }
};

// Length and 1 / max(length, 1e-18) from the square.
__device__ __forceinline__ void length_of(real squared, real& length, real& inverse) {
#if defined(CLOTH_FAST)
    inverse = rsqrt(maximum(squared, (real)1e-36));
    length = squared * inverse;
#elif defined(CLOTH_F64)
    length = root(squared);
    inverse = (real)1 / maximum(length, LENGTH_MIN);
#else
    length = root_in_line(squared);
    inverse = reciprocal_in_line(maximum(length, LENGTH_MIN));
#endif
}

// `PLAIN` says that the length is not so small that it needs care.
template <bool PLAIN = false>
__device__ __forceinline__ Spring spring_at(const SpringKind& kind, const vec3& xi, const vec3& vi, const vec3& xj, const vec3& vj) {
    Spring spring;
    vec3 d = xj - xi;
    spring.difference = d;
    spring.length_squared = dot(d, d);
#if !defined(CLOTH_FAST) && !defined(CLOTH_F64)
    if (PLAIN) {
        spring.length = root_plain(spring.length_squared);
        spring.inverse_length = reciprocal_in_line(spring.length);
    } else
#endif
    length_of(spring.length_squared, spring.length, spring.inverse_length);
    real rate = ((vj.x - vi.x) * d.x + (vj.y - vi.y) * d.y + (vj.z - vi.z) * d.z) * spring.inverse_length;
    spring.stretch = spring.length - kind.rest_length;
    spring.tension = kind.tension(spring.stretch) + kind.damping * rate;
    return spring;
}
