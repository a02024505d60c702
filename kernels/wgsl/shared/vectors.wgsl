// NUMERICS section 5: the vectors of the linear system, one after the other, three numbers for each
// particle and a fourth that means nothing.

@group(0) @binding(32) var<storage, read_write> vectors: array<vec4f>;

const VECTOR_SOLUTION: u32 = 0u;
const VECTOR_RIGHT_SIDE: u32 = 1u;
const VECTOR_RESIDUAL: u32 = 2u;
const VECTOR_PRECONDITIONED: u32 = 3u;
const VECTOR_IMAGE: u32 = 4u;
const VECTOR_DIRECTION: u32 = 5u;
const VECTOR_DIRECTION_IMAGE: u32 = 6u;
// Residual, image and image of the direction again: where an iteration is one kernel, two copies take turns.
const VECTOR_RESIDUAL_ODD: u32 = 7u;
const VECTOR_IMAGE_ODD: u32 = 8u;
const VECTOR_DIRECTION_IMAGE_ODD: u32 = 9u;

fn vector_get(vector: u32, particle: u32) -> vec3f {
    return vectors[vector * model.particle_count + particle].xyz;
}

fn vector_set(vector: u32, particle: u32, value: vec3f) {
    vectors[vector * model.particle_count + particle] = vec4f(value, 0.0);
}
