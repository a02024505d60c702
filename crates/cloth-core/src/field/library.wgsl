// Functions of procedural fields: the operations of crates/cloth-core/src/field/functions.rs and
// noise.rs, in the same order. Products that are added to something are `fma`, so that no compiler has a choice.

fn field_bounded(value: f32, low: f32, high: f32) -> f32 {
    let below = select(value, high, value > high);
    return select(below, low, below < low);
}

fn field_sine_shifted(x: f32, quarters_ahead: f32) -> f32 {
    let turns = floor(fma(x, 0.63661975f, 0.5f));
    var rest = fma(-turns, 1.2675908e-6f, fma(-turns, 4.825592e-4f, fma(-turns, 1.5703125f, x)));
    rest = field_bounded(rest, -0.8f, 0.8f);
    let z = rest * rest;
    var sine = 2.7557319e-6f;
    sine = fma(sine, z, -1.984127e-4f);
    sine = fma(sine, z, 8.333334e-3f);
    sine = fma(sine, z, -1.6666667e-1f);
    var cosine = -2.755732e-7f;
    cosine = fma(cosine, z, 2.4801588e-5f);
    cosine = fma(cosine, z, -1.3888889e-3f);
    cosine = fma(cosine, z, 4.1666668e-2f);
    cosine = fma(cosine, z, -0.5f);
    sine = fma(rest, z * sine, rest);
    cosine = fma(z, cosine, 1.0f);
    var quarters = turns + quarters_ahead;
    quarters = fma(-4.0f, floor(quarters * 0.25f), quarters);
    let value = select(sine, cosine, quarters == 1.0f || quarters == 3.0f);
    return select(value, -value, quarters >= 2.0f);
}

fn field_sine(x: f32) -> f32 {
    return field_sine_shifted(x, 0.0f);
}

fn field_cosine(x: f32) -> f32 {
    return field_sine_shifted(x, 1.0f);
}

fn field_power_of_two(exponent: i32) -> f32 {
    return bitcast<f32>(u32(exponent + 127) << 23u);
}

fn field_exponential(argument: f32) -> f32 {
    let x = field_bounded(argument, -104.0f, 89.0f);
    let doublings = floor(fma(x, 1.442695f, 0.5f));
    let rest = fma(-doublings, 1.4286068e-6f, fma(-doublings, 0.69314575f, x));
    var series = 1.984127e-4f;
    series = fma(series, rest, 1.3888889e-3f);
    series = fma(series, rest, 8.333334e-3f);
    series = fma(series, rest, 4.1666668e-2f);
    series = fma(series, rest, 1.6666667e-1f);
    series = fma(series, rest, 0.5f);
    series = fma(series, rest, 1.0f);
    series = fma(series, rest, 1.0f);
    let exponent = i32(doublings);
    let half = exponent >> 1u;
    return series * field_power_of_two(half) * field_power_of_two(exponent - half);
}

fn field_logarithm(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    var significand = bitcast<f32>((bits & 0x7fffffu) | 0x3f800000u);
    var exponent = i32(bits >> 23u) - 127;
    let is_high = significand > 1.4142135f;
    significand = select(significand, significand * 0.5f, is_high);
    exponent = select(exponent, exponent + 1, is_high);
    let number = f32(exponent);
    let s = (significand - 1.0f) / (significand + 1.0f);
    let z = s * s;
    var series = 1.1111111e-1f;
    series = fma(series, z, 1.4285715e-1f);
    series = fma(series, z, 2e-1f);
    series = fma(series, z, 3.3333334e-1f);
    let twice = s + s;
    var value = fma(
        number, 0.69314575f, twice + fma(twice, z * series, number * 1.4286068e-6f));
    // Infinity and NaN cannot be written as constants.
    var infinity = 0x7f800000u;
    var not_a_number = 0x7fc00000u;
    value = select(-bitcast<f32>(infinity), value, x >= 1.1754944e-38f);
    value = select(x, value, x <= 3.4028235e38f);
    return select(value, bitcast<f32>(not_a_number), x < 0.0f);
}

fn field_power(a: f32, b: f32) -> f32 {
    return select(field_exponential(b * field_logarithm(a)), 1.0f, b == 0.0f);
}

fn field_hash(lattice: vec3<i32>) -> u32 {
    let point = bitcast<vec3<u32>>(lattice);
    var h = (point.x * 0x9e3779b1u) ^ (point.y * 0x85ebca77u) ^ (point.z * 0xc2b2ae3du);
    h ^= h >> 16u;
    h *= 0x7feb352du;
    h ^= h >> 15u;
    h *= 0x846ca68bu;
    return h ^ (h >> 16u);
}

fn field_corner(lattice: vec3<i32>, offset: vec3<f32>) -> f32 {
    let h = field_hash(lattice) & 15u;
    let first = select(offset.y, offset.x, h < 8u);
    let second = select(select(offset.z, offset.x, h == 12u || h == 14u), offset.y, h < 4u);
    return select(-first, first, (h & 1u) == 0u) + select(-second, second, (h & 2u) == 0u);
}

fn field_mix(a: f32, b: f32, share: f32) -> f32 {
    return fma(share, b - a, a);
}

fn field_edge(lattice: vec3<i32>, offset: vec3<f32>, share: f32) -> f32 {
    let left = field_corner(lattice, offset);
    let right = field_corner(
        lattice + vec3<i32>(1, 0, 0), vec3<f32>(offset.x - 1.0f, offset.y, offset.z));
    return field_mix(left, right, share);
}

fn field_noise(point: vec3<f32>) -> f32 {
    let base = floor(point);
    let lattice = vec3<i32>(base);
    let low = point - base;
    let high = low - vec3<f32>(1.0f);
    let t = low;
    let share = t * t * t
        * fma(t, fma(t, vec3<f32>(6.0f), vec3<f32>(-15.0f)), vec3<f32>(10.0f));
    let front_low = field_edge(lattice, low, share.x);
    let back_low = field_edge(
        lattice + vec3<i32>(0, 1, 0), vec3<f32>(low.x, high.y, low.z), share.x);
    let front_high = field_edge(
        lattice + vec3<i32>(0, 0, 1), vec3<f32>(low.x, low.y, high.z), share.x);
    let back_high = field_edge(
        lattice + vec3<i32>(0, 1, 1), vec3<f32>(low.x, high.y, high.z), share.x);
    return field_mix(
        field_mix(front_low, back_low, share.y),
        field_mix(front_high, back_high, share.y),
        share.z);
}
