// NUMERICS section 5: P^-1 of the present matrix and constraints.
//!include model status call motion symmetric matrix matrix_diagonal preconditioner preconditioner_block
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!include filter

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
    preconditioner_set(particle, block);
}
