// What a triangle makes of the folds around it.

const PATCH_FOLDS: u32 = 9u;

// Damping of bending [s].
fn bending_damping(number: u32) -> f32 {
    return bitcast<f32>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_AREA].y);
}

// The three numbers for a fold.
fn patch_map(number: u32, k: u32) -> vec3f {
    return bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_FOLDS + k]).xyz;
}
