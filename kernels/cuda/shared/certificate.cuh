// NUMERICS section 14: a proof that two features in linear motion do not meet, operation for operation that of `contact::certify`.

// Four points: a vertex and a triangle, or two edges.
struct Points {
    vec3 x[4];
};

// Half of the margin, as the unit of roundoff is half of REAL_EPSILON; and twice the margin for what is no normal number.
#define CERTIFICATE_RELATIVE ((real)4 * (real)REAL_EPSILON)
#define CERTIFICATE_SMALLEST ((real)16 * (real)REAL_MIN_POSITIVE)

__device__ __forceinline__ bool exceeds(const vec3& d, const vec3& axis, real floor) {
    real x = axis.x * d.x, y = axis.y * d.y, z = axis.z * d.z;
    return x + y + z > CERTIFICATE_RELATIVE * (absolute(x) + absolute(y) + absolute(z)) + floor;
}

// Whether the axis keeps both features more than `delta` apart.
__device__ __forceinline__ bool is_apart(const Points& p, const vec3& axis, bool edges, real delta) {
    real floor = delta + CERTIFICATE_SMALLEST;
    bool apart = exceeds(p.x[0] - p.x[2], axis, floor) && exceeds(p.x[0] - p.x[3], axis, floor);
    if (!edges) return apart && exceeds(p.x[0] - p.x[1], axis, floor);
    return apart && exceeds(p.x[1] - p.x[2], axis, floor) && exceeds(p.x[1] - p.x[3], axis, floor);
}

// The vector from the origin to the closest point of the segment p q.
__device__ __forceinline__ vec3 segment(const vec3& p, const vec3& q) {
    vec3 edge = q - p;
    real share = -dot(p, edge) / maximum(dot(edge, edge), (real)REAL_MIN_POSITIVE);
    share = minimum(maximum(share, (real)0), (real)1);
    return p + share * edge;
}

__device__ __forceinline__ vec3 shortest(const vec3& a, const vec3& b) { return dot(a, a) <= dot(b, b) ? a : b; }

__device__ __forceinline__ vec3 negative(const vec3& a) { return {-a.x, -a.y, -a.z}; }

// The vector with length 1, or zero.
__device__ __forceinline__ vec3 unit(const vec3& v) {
    real largest = maximum(maximum(absolute(v.x), absolute(v.y)), absolute(v.z));
    vec3 scaled = v * ((real)1 / maximum(largest, (real)REAL_MIN_POSITIVE));
    real inverse = (real)1 / maximum(root(dot(scaled, scaled)), (real)REAL_MIN_POSITIVE);
    return scaled * inverse;
}

// The direction of the closest vector between the features, and the other of both candidates for it.
struct Directions {
    vec3 first, second;
};

__device__ __forceinline__ Directions directions(const Points& p, bool edges) {
    vec3 r1 = p.x[1] - p.x[0], r2 = p.x[2] - p.x[0], r3 = p.x[3] - p.x[0];
    vec3 normal, across, border;
    bool is_inside;
    if (edges) {
        vec3 v = p.x[3] - p.x[2];
        normal = cross(r1, v);
        across = r2;
        real square = dot(normal, normal);
        real s = dot(cross(r2, v), normal);
        real t = dot(cross(r2, r1), normal);
        is_inside = s > 0 && s < square && t > 0 && t < square;
        vec3 ac = p.x[0] - p.x[2], ad = p.x[0] - p.x[3], bc = p.x[1] - p.x[2], bd = p.x[1] - p.x[3];
        border = shortest(shortest(segment(ac, ad), segment(bc, bd)), shortest(segment(ac, bc), segment(ad, bd)));
    } else {
        normal = cross(r2 - r1, r3 - r1);
        across = r1;
        is_inside = dot(cross(r2, r3), normal) > 0 && dot(cross(r3, r1), normal) > 0 && dot(cross(r1, r2), normal) > 0;
        vec3 ab = p.x[0] - p.x[1], ac = p.x[0] - p.x[2], ad = p.x[0] - p.x[3];
        border = shortest(shortest(segment(ab, ac), segment(ac, ad)), segment(ad, ab));
    }
    if (dot(normal, across) > 0) normal = negative(normal);
    if (is_inside) return {normal, border};
    return {border, normal};
}

__device__ __forceinline__ bool proves(const Points& start, const Points& end, const vec3& axis, bool edges, real delta) {
    return is_apart(start, axis, edges, (real)0) && is_apart(end, axis, edges, delta);
}

// The range of some points along an axis of space.
struct Range {
    real low, high;
};

__device__ __forceinline__ Range range_of(const Points& p, uint first, uint end, uint axis) {
    Range range = {component(p.x[first], axis), component(p.x[first], axis)};
    for (uint k = first + 1; k < end; k++) {
        range.low = minimum(range.low, component(p.x[k], axis));
        range.high = maximum(range.high, component(p.x[k], axis));
    }
    return range;
}

// An axis of space along which they are apart, which takes only comparisons.
__device__ __forceinline__ bool along_axes(const Points& start, const Points& end, bool edges, real delta) {
    uint middle = edges ? 2 : 1;
    for (uint axis = 0; axis < 3; axis++) {
        Range a0 = range_of(start, 0, middle, axis), b0 = range_of(start, middle, 4, axis);
        Range a1 = range_of(end, 0, middle, axis), b1 = range_of(end, middle, 4, axis);
        if (a0.low > b0.high && a1.low - b1.high > delta) return true;
        if (b0.low > a0.high && b1.low - a1.high > delta) return true;
    }
    return false;
}

__device__ __forceinline__ bool is_proven(const Points& start, const Points& end, bool edges, real delta) {
    if (along_axes(start, end, edges, delta)) return true;
    Directions at_start = directions(start, edges);
    if (proves(start, end, unit(at_start.first), edges, delta)) return true;
    Directions at_end = directions(end, edges);
    return proves(start, end, unit(at_end.first), edges, delta) || proves(start, end, unit(at_start.second), edges, delta) ||
           proves(start, end, unit(at_end.second), edges, delta);
}
