// NUMERICS section 5: B, two places for each particle: xx, yy, zz and what the filter does, then xy, xz, yz.

@group(0) @binding(39) var<storage, read_write> matrix_base: array<vec4f>;

// The particle is free.
const FILTER_FREE: f32 = 1.0;
// It is held: S = 0.
const FILTER_HELD: f32 = 0.0;
// Colliders constrain it.
const FILTER_CONSTRAINED: f32 = -1.0;

fn filter_kind(particle: u32) -> f32 {
    return matrix_base[2u * particle].w;
}
