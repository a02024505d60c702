// NUMERICS section 5, matrix_apply: a spring in a row of A times a vector.

// The sum with one spring more.
fn matrix_entry(sum: vec3f, factor: vec4f, difference: vec3f) -> vec3f {
    let along = dot_product(factor.xyz, difference);
    return add_scaled(add_scaled(sum, max(factor.w, 0.0), difference), along, factor.xyz);
}
