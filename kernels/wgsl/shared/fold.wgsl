// NUMERICS section 12: a triangle that resists curvature, as the folds around it tell it.

// A fold about the edge of vertices 0 and 1, with the third vertices 2 and 3 of both triangles: of what its derivatives by the four consist, those by
// the third vertices [1/m], and where the feet of these lie on the edge, 0 at its start and 1 at its end.
struct Fold {
    apex: vec3f,
    beyond: vec3f,
    feet: vec2f,
}

struct FoldAt {
    fold: Fold,
    angle: f32,
}

const PATCH_VERTICES: u32 = 12u;
const PATCH_FOLDS: u32 = 9u;

// Smallest normal number.
const NUMBER_MIN: f32 = 1.17549435e-38;

fn fold_of(x0: vec3f, x1: vec3f, x2: vec3f, x3: vec3f) -> FoldAt {
    let e = x1 - x0;
    let a = x2 - x0;
    let b = x3 - x0;
    let n1 = cross_product(e, a);
    let n2 = cross_product(b, e);
    let square = dot_product(e, e);
    let length = sqrt(square);
    let angle = arctangent2(length * dot_product(n1, b), dot_product(n1, n2));
    let apex = n1 * (length / max(dot_product(n1, n1), NUMBER_MIN));
    let beyond = n2 * (length / max(dot_product(n2, n2), NUMBER_MIN));
    let w1 = dot_product(a, e) / max(square, NUMBER_MIN);
    let w2 = dot_product(b, e) / max(square, NUMBER_MIN);
    return FoldAt(Fold(apex, beyond, vec2f(w1, w2)), angle);
}

// The derivative by the start of the edge.
fn fold_start(fold: Fold) -> vec3f {
    return fma(vec3f(fold.feet.y - 1.0), fold.beyond, (fold.feet.x - 1.0) * fold.apex);
}

// The derivative by its end.
fn fold_end(fold: Fold) -> vec3f {
    return fma(vec3f(-fold.feet.y), fold.beyond, -fold.feet.x * fold.apex);
}

// The shorter way around.
fn angle_difference(angle: f32, rest: f32) -> f32 {
    let difference = angle - rest;
    if difference > PI {
        return difference - 2.0 * PI;
    }
    if difference < -PI {
        return difference + 2.0 * PI;
    }
    return difference;
}

// The places in the patch of the vertices of a fold: start and end of the edge, third vertex, the one beyond. Three bits for each fold, the first one last: of
// the edges ab, bc, ca, and for each of these of the triangle beyond, from the edge's start to its apex and from there to its end.
fn fold_places(number: u32) -> vec4<u32> {
    let bits = vec3<u32>(0x550b088u, 0xaa1611u, 0x2050242u) >> vec3<u32>(3u * number);
    return vec4<u32>(bits & vec3<u32>(7u), 3u + number);
}

// Damping of bending [s].
fn bending_damping(number: u32) -> f32 {
    return bitcast<f32>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_LAW].z);
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

// The moments of a curvature, times the area [N m^2].
fn plate_moment(number: u32, curvature: vec3f) -> vec3f {
    let plate = bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_PLATE]);
    let k = curvature;
    return vec3f(fma(plate.z, k.y, plate.x * k.x), fma(plate.y, k.y, plate.z * k.x), plate.w * k.z);
}
