// NUMERICS section 5, spring_linearise: what a spring keeps for a substep.

// u and e of a spring of this kind, whose first word is `word`, so that g is max(0, e). Seen from its other end u has the
// other sign.
fn spring_factor(kind: u32, word: vec4<u32>, difference: vec3f) -> vec4f {
    let numbers = bitcast<vec4f>(word);
    let length = sqrt(dot_product(difference, difference));
    let inverse_length = 1.0 / max(length, LENGTH_MIN);
    let stretch = length - numbers.y;
    let square = substep.length * substep.length;
    let e = square * elastic_tension(kind, numbers.z, stretch) * inverse_length;
    let slope = elastic_slope(kind, numbers.z, stretch);
    let along = fma(square, slope, substep.length * numbers.w);
    let root = sqrt(max(along - max(e, 0.0), 0.0)) * inverse_length;
    let u = root * difference;
    // Without a direction all of the stiffness is across; e has nothing to pull along.
    let across = select(e, along - dot_product(u, u), length <= LENGTH_MIN);
    return vec4f(u, across);
}
