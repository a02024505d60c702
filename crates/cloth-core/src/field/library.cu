// Functions of procedural fields: the operations of crates/cloth-core/src/field/functions.rs and
// noise.rs, in the same order, for float and double.

template <typename T> struct FieldReal;

template <> struct FieldReal<float> {
    static constexpr bool is_double = false;
    static __device__ __forceinline__ float floor_of(float x) { return floorf(x); }
    static __device__ __forceinline__ int floor_to_int(float x) { return __float2int_rd(x); }
    static __device__ __forceinline__ float power_of_two(int exponent) {
        return __int_as_float((exponent + 127) << 23);
    }
    static __device__ __forceinline__ float significand(float x) {
        return __int_as_float((__float_as_int(x) & 0x7fffff) | 0x3f800000);
    }
    static __device__ __forceinline__ int exponent(float x) {
        return (int)((unsigned int)__float_as_int(x) >> 23) - 127;
    }
    static __device__ __forceinline__ float infinity() { return __int_as_float(0x7f800000); }
    static __device__ __forceinline__ float not_a_number() { return __int_as_float(0x7fc00000); }
    static __device__ __forceinline__ float least() { return 1.17549435e-38f; }
    static __device__ __forceinline__ float largest() { return 3.40282347e38f; }
};

template <> struct FieldReal<double> {
    static constexpr bool is_double = true;
    static __device__ __forceinline__ double floor_of(double x) { return floor(x); }
    static __device__ __forceinline__ int floor_to_int(double x) { return __double2int_rd(x); }
    static __device__ __forceinline__ double power_of_two(int exponent) {
        return __longlong_as_double((long long)(exponent + 1023) << 52);
    }
    static __device__ __forceinline__ double significand(double x) {
        return __longlong_as_double(
            (__double_as_longlong(x) & 0xfffffffffffffLL) | 0x3ff0000000000000LL);
    }
    static __device__ __forceinline__ int exponent(double x) {
        return (int)((unsigned long long)__double_as_longlong(x) >> 52) - 1023;
    }
    static __device__ __forceinline__ double infinity() {
        return __longlong_as_double(0x7ff0000000000000LL);
    }
    static __device__ __forceinline__ double not_a_number() {
        return __longlong_as_double(0x7ff8000000000000LL);
    }
    static __device__ __forceinline__ double least() { return 2.2250738585072014e-308; }
    static __device__ __forceinline__ double largest() { return 1.7976931348623157e308; }
};

template <typename T>
static __device__ __forceinline__ T field_bounded(T value, T low, T high) {
    value = value > high ? high : value;
    return value < low ? low : value;
}

template <typename T>
static __device__ __forceinline__ T field_sine_shifted(T x, T quarters_ahead) {
    constexpr bool d = FieldReal<T>::is_double;
    const T first = T(d ? 1.570796325802803 : 1.5703125);
    const T second = T(d ? 9.920935791635221e-10 : 4.825592041015625e-4);
    const T third = T(d ? 5.170182981794105e-19 : 1.2675907950567314e-6);
    const T turns = FieldReal<T>::floor_of(x * T(0.63661977236758134308) + T(0.5));
    T rest = ((x - turns * first) - turns * second) - turns * third;
    rest = field_bounded(rest, -T(0.8), T(0.8));
    const T z = rest * rest;
    T sine, cosine;
    if (d) {
        sine = T(1.0 / 355687428096000.0);
        sine = sine * z + T(-1.0 / 1307674368000.0);
        sine = sine * z + T(1.0 / 6227020800.0);
        sine = sine * z + T(-1.0 / 39916800.0);
        sine = sine * z + T(1.0 / 362880.0);
        cosine = T(1.0 / 20922789888000.0);
        cosine = cosine * z + T(-1.0 / 87178291200.0);
        cosine = cosine * z + T(1.0 / 479001600.0);
        cosine = cosine * z + T(-1.0 / 3628800.0);
    } else {
        sine = T(1.0 / 362880.0);
        cosine = T(-1.0 / 3628800.0);
    }
    sine = sine * z + T(-1.0 / 5040.0);
    sine = sine * z + T(1.0 / 120.0);
    sine = sine * z + T(-1.0 / 6.0);
    cosine = cosine * z + T(1.0 / 40320.0);
    cosine = cosine * z + T(-1.0 / 720.0);
    cosine = cosine * z + T(1.0 / 24.0);
    cosine = cosine * z + T(-0.5);
    sine = rest + rest * (z * sine);
    cosine = T(1.0) + z * cosine;
    T quarters = turns + quarters_ahead;
    quarters = quarters - T(4.0) * FieldReal<T>::floor_of(quarters * T(0.25));
    const T value = (quarters == T(1.0) || quarters == T(3.0)) ? cosine : sine;
    return quarters >= T(2.0) ? -value : value;
}

template <typename T>
static __device__ __forceinline__ T field_sine(T x) {
    return field_sine_shifted(x, T(0.0));
}

template <typename T>
static __device__ __forceinline__ T field_cosine(T x) {
    return field_sine_shifted(x, T(1.0));
}

template <typename T>
static __device__ __forceinline__ T field_exponential(T argument) {
    constexpr bool d = FieldReal<T>::is_double;
    const T first = T(d ? 0.6931471803691238 : 0.693145751953125);
    const T second = T(d ? 1.9082149292705877e-10 : 1.4286068203094173e-6);
    const T x = field_bounded(argument, T(d ? -746.0 : -104.0), T(d ? 710.0 : 89.0));
    const T doublings = FieldReal<T>::floor_of(x * T(1.44269504088896340736) + T(0.5));
    const T rest = (x - doublings * first) - doublings * second;
    T series;
    if (d) {
        series = T(1.0 / 6227020800.0);
        series = series * rest + T(1.0 / 479001600.0);
        series = series * rest + T(1.0 / 39916800.0);
        series = series * rest + T(1.0 / 3628800.0);
        series = series * rest + T(1.0 / 362880.0);
        series = series * rest + T(1.0 / 40320.0);
        series = series * rest + T(1.0 / 5040.0);
    } else {
        series = T(1.0 / 5040.0);
    }
    series = series * rest + T(1.0 / 720.0);
    series = series * rest + T(1.0 / 120.0);
    series = series * rest + T(1.0 / 24.0);
    series = series * rest + T(1.0 / 6.0);
    series = series * rest + T(0.5);
    series = series * rest + T(1.0);
    series = series * rest + T(1.0);
    const int exponent = FieldReal<T>::floor_to_int(doublings);
    const int half = exponent >> 1;
    return series * FieldReal<T>::power_of_two(half) * FieldReal<T>::power_of_two(exponent - half);
}

template <typename T>
static __device__ __forceinline__ T field_logarithm(T x) {
    constexpr bool d = FieldReal<T>::is_double;
    const T first = T(d ? 0.6931471803691238 : 0.693145751953125);
    const T second = T(d ? 1.9082149292705877e-10 : 1.4286068203094173e-6);
    T significand = FieldReal<T>::significand(x);
    int exponent = FieldReal<T>::exponent(x);
    if (significand > T(1.41421356237309504880)) {
        significand = significand * T(0.5);
        exponent = exponent + 1;
    }
    const T number = T(exponent);
    const T s = (significand - T(1.0)) / (significand + T(1.0));
    const T z = s * s;
    T series;
    if (d) {
        series = T(1.0 / 19.0);
        series = series * z + T(1.0 / 17.0);
        series = series * z + T(1.0 / 15.0);
        series = series * z + T(1.0 / 13.0);
        series = series * z + T(1.0 / 11.0);
        series = series * z + T(1.0 / 9.0);
    } else {
        series = T(1.0 / 9.0);
    }
    series = series * z + T(1.0 / 7.0);
    series = series * z + T(1.0 / 5.0);
    series = series * z + T(1.0 / 3.0);
    const T twice = s + s;
    T value = number * first + (twice + (twice * (z * series) + number * second));
    value = x >= FieldReal<T>::least() ? value : -FieldReal<T>::infinity();
    value = x <= FieldReal<T>::largest() ? value : x;
    return x < T(0.0) ? FieldReal<T>::not_a_number() : value;
}

template <typename T>
static __device__ __forceinline__ T field_power(T a, T b) {
    const T value = field_exponential(b * field_logarithm(a));
    return b == T(0.0) ? T(1.0) : value;
}

static __device__ __forceinline__ unsigned int field_hash(int x, int y, int z) {
    unsigned int h = ((unsigned int)x * 0x9e3779b1u) ^ ((unsigned int)y * 0x85ebca77u)
        ^ ((unsigned int)z * 0xc2b2ae3du);
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

template <typename T>
static __device__ __forceinline__ T field_corner(int i, int j, int k, T x, T y, T z) {
    const unsigned int h = field_hash(i, j, k) & 15u;
    const T first = h < 8u ? x : y;
    const T second = h < 4u ? y : ((h == 12u || h == 14u) ? x : z);
    return ((h & 1u) == 0u ? first : -first) + ((h & 2u) == 0u ? second : -second);
}

template <typename T>
static __device__ __forceinline__ T field_mix(T a, T b, T share) {
    return a + share * (b - a);
}

template <typename T>
static __device__ __forceinline__ T field_fade(T t) {
    return t * t * t * (t * (t * T(6.0) - T(15.0)) + T(10.0));
}

template <typename T>
static __device__ __forceinline__ T field_noise(T x, T y, T z) {
    const T fx = FieldReal<T>::floor_of(x), fy = FieldReal<T>::floor_of(y);
    const T fz = FieldReal<T>::floor_of(z);
    const int i = FieldReal<T>::floor_to_int(fx), j = FieldReal<T>::floor_to_int(fy);
    const int k = FieldReal<T>::floor_to_int(fz);
    // Unsigned, as these sums wrap.
    const int i1 = (int)((unsigned int)i + 1u), j1 = (int)((unsigned int)j + 1u);
    const int k1 = (int)((unsigned int)k + 1u);
    const T x0 = x - fx, y0 = y - fy, z0 = z - fz;
    const T x1 = x0 - T(1.0), y1 = y0 - T(1.0), z1 = z0 - T(1.0);
    const T u = field_fade(x0), v = field_fade(y0), w = field_fade(z0);
    const T front_low =
        field_mix(field_corner(i, j, k, x0, y0, z0), field_corner(i1, j, k, x1, y0, z0), u);
    const T back_low =
        field_mix(field_corner(i, j1, k, x0, y1, z0), field_corner(i1, j1, k, x1, y1, z0), u);
    const T front_high =
        field_mix(field_corner(i, j, k1, x0, y0, z1), field_corner(i1, j, k1, x1, y0, z1), u);
    const T back_high =
        field_mix(field_corner(i, j1, k1, x0, y1, z1), field_corner(i1, j1, k1, x1, y1, z1), u);
    return field_mix(
        field_mix(front_low, back_low, v), field_mix(front_high, back_high, v), w);
}
