// NUMERICS section 12: a fold between two triangles.

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
