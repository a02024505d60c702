// NUMERICS section 5: D, two places for each particle: xx, yy, zz, then xy, xz, yz.

@group(0) @binding(40) var<storage, read_write> matrix_diagonal: array<vec4f>;

fn matrix_diagonal_get(particle: u32) -> Symmetric {
    return Symmetric(matrix_diagonal[2u * particle].xyz, matrix_diagonal[2u * particle + 1u].xyz);
}
