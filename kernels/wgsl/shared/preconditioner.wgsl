// NUMERICS section 5: P^-1, two places for each particle: xx, yy, zz, then xy, xz, yz.

@group(0) @binding(41) var<storage, read_write> inverse: array<vec4f>;

// S P^-1 y; blocks are read only if the preconditioner has any.
fn preconditioned(particle: u32, kind: f32, y: vec3f) -> vec3f {
    return preconditioned_by(inverse[2u * particle], particle, kind, y);
}

// The same, with the first of both places known.
fn preconditioned_by(on: vec4f, particle: u32, kind: f32, y: vec3f) -> vec3f {
    var result = on.xyz * y;
    if on.w != 0.0 {
        result = symmetric_apply(Symmetric(on.xyz, inverse[2u * particle + 1u].xyz), y);
    }
    return filtered(particle, kind, result);
}
