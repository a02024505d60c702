// NUMERICS section 5, preconditioner_build: P^-1 of a block of D, or of its diagonal.

const ROUNDING: f32 = 1.1920929e-7;

fn trace(block: Symmetric) -> f32 {
    return block.on.x + block.on.y + block.on.z;
}

// From the Cholesky factors L L^T.
fn inverted(block: Symmetric) -> Symmetric {
    let size = trace(block);
    let safety = 4.0 * ROUNDING * size;
    let least = max(safety, 1e-30);
    let a_inverse = 1.0 / sqrt(max(block.on.x + safety, least));
    let b = block.off.x * a_inverse;
    let c = block.off.y * a_inverse;
    let d_inverse = 1.0 / sqrt(max(fma(-b, b, block.on.y + safety), least));
    let e = fma(-b, c, block.off.z) * d_inverse;
    let f_inverse = 1.0 / sqrt(max(fma(-e, e, fma(-c, c, block.on.z + safety)), least));
    // Columns of the inverse of L.
    let q = -(b * a_inverse) * d_inverse;
    let r = -fma(e, q, c * a_inverse) * f_inverse;
    let t = -(e * d_inverse) * f_inverse;
    let p = a_inverse;
    return Symmetric(
        vec3f(
            fma(p, p, fma(q, q, r * r)),
            fma(d_inverse, d_inverse, t * t),
            f_inverse * f_inverse,
        ),
        vec3f(fma(q, d_inverse, r * t), r * f_inverse, t * f_inverse),
    );
}

fn preconditioner_set(particle: u32, block: Symmetric) {
    let blocks = call_has(CALL_BLOCKS);
    var result = Symmetric(1.0 / block.on, vec3f(0.0));
    if blocks {
        result = inverted(block);
    }
    inverse[2u * particle] = vec4f(result.on, select(0.0, 1.0, blocks));
    inverse[2u * particle + 1u] = vec4f(result.off, 0.0);
}
