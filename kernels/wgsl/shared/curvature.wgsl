// The curvature of a triangle by the motion of its patch.

const PATCH_VERTICES: u32 = 12u;

// The places in the patch of the vertices of a fold: start and end of the edge, third vertex, the one beyond. Three bits for each fold, the first one last: of
// the edges ab, bc, ca, and for each of these of the triangle beyond, from the edge's start to its apex and from there to its end.
fn fold_places(number: u32) -> vec4<u32> {
    let bits = vec3<u32>(0x550b088u, 0xaa1611u, 0x2050242u) >> vec3<u32>(3u * number);
    return vec4<u32>(bits & vec3<u32>(7u), 3u + number);
}

// The curvature for the folds of a patch, which are kept in `folds`: `still` times what they are beyond rest, plus `moving` times their rates.
fn curvature_of(number: u32, still: f32, moving: f32, folds: ptr<function, array<Fold, PATCH_FOLDS>>) -> vec3f {
    var curvature = vec3f(0.0);
    for (var k = 0u; k < PATCH_FOLDS; k += 1u) {
        let places = fold_places(k);
        let a = patch_particle(number, places.x);
        let b = patch_particle(number, places.y);
        let c = patch_particle(number, places.z);
        let d = patch_particle(number, places.w);
        let at = fold_of(position_in[a].xyz, position_in[b].xyz, position_in[c].xyz, position_in[d].xyz);
        let rest = bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_FOLDS + k]);
        var bent = still * angle_difference(at.angle, rest.x);
        if moving != 0.0 {
            let ends = dot_product(fold_start(at.fold), velocity_in[a].xyz) + dot_product(fold_end(at.fold), velocity_in[b].xyz);
            let third = dot_product(at.fold.apex, velocity_in[c].xyz);
            bent = fma(moving, ends + third + dot_product(at.fold.beyond, velocity_in[d].xyz), bent);
        }
        (*folds)[k] = at.fold;
        curvature = fma(vec3f(bent), rest.yzw, curvature);
    }
    return curvature;
}
