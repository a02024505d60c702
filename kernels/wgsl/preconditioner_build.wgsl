// NUMERICS section 5: P^-1 of the present matrix and constraints.
//!include model status call motion symmetric matrix matrix_diagonal preconditioner
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!include filter

const ROUNDING: f32 = 1.1920929e-7;

fn trace(block: Symmetric) -> f32 {
    return block.on.x + block.on.y + block.on.z;
}

fn rows(matrix: Symmetric) -> mat3x3f {
    return mat3x3f(
        vec3f(matrix.on.x, matrix.off.x, matrix.off.y),
        vec3f(matrix.off.x, matrix.on.y, matrix.off.z),
        vec3f(matrix.off.y, matrix.off.z, matrix.on.z),
    );
}

// S D S + tr(D) (I - S)
fn restricted(block: Symmetric, filter_block: Symmetric) -> Symmetric {
    let s = rows(filter_block);
    let sds = s * rows(block) * s;
    let size = trace(block);
    return Symmetric(
        vec3f(sds[0].x, sds[1].y, sds[2].z) + size * (vec3f(1.0) - filter_block.on),
        vec3f(sds[0].y, sds[0].z, sds[1].z) - size * filter_block.off,
    );
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

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let kind = filter_kind_now(particle, position_in[particle].w);
    var block = matrix_diagonal_get(particle);
    if kind == FILTER_CONSTRAINED {
        block = restricted(block, constraint_filter_of(particle));
    }
    let blocks = call_has(CALL_BLOCKS);
    var result = Symmetric(1.0 / block.on, vec3f(0.0));
    if blocks {
        result = inverted(block);
    }
    inverse[2u * particle] = vec4f(result.on, select(0.0, 1.0, blocks));
    inverse[2u * particle + 1u] = vec4f(result.off, 0.0);
}
