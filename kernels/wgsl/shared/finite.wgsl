// Whether a number is finite, by its bits: compilers may take every comparison with NaN for granted.

fn is_finite(value: vec3f) -> bool {
    let exponent = bitcast<vec3<u32>>(value) & vec3<u32>(0x7f800000u);
    return all(exponent != vec3<u32>(0x7f800000u));
}
