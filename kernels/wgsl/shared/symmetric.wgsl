// Symmetric 3 x 3 matrices.

struct Symmetric {
    // xx, yy, zz
    on: vec3f,
    // xy, xz, yz
    off: vec3f,
}

fn symmetric_apply(matrix: Symmetric, y: vec3f) -> vec3f {
    return vec3f(
        fma(matrix.off.y, y.z, fma(matrix.off.x, y.y, matrix.on.x * y.x)),
        fma(matrix.off.z, y.z, fma(matrix.on.y, y.y, matrix.off.x * y.x)),
        fma(matrix.on.z, y.z, fma(matrix.off.z, y.y, matrix.off.y * y.x)),
    );
}

// matrix + scale a a^T
fn symmetric_add_outer(matrix: Symmetric, scale: f32, a: vec3f) -> Symmetric {
    let scaled = scale * a;
    return Symmetric(
        fma(scaled, a, matrix.on),
        fma(scaled.xxy, a.yzz, matrix.off),
    );
}
