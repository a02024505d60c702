// What a triangle makes of the folds around it.

const PATCH_FOLDS: u32 = 9u;

// Damping of bending [s].
fn bending_damping(number: u32) -> f32 {
    return bitcast<f32>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_LAW].z);
}

// The moments of a curvature, times the area [N m^2].
fn plate_moment(number: u32, curvature: vec3f) -> vec3f {
    let plate = bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_PLATE]);
    let k = curvature;
    return vec3f(fma(plate.z, k.y, plate.x * k.x), fma(plate.y, k.y, plate.z * k.x), plate.w * k.z);
}
