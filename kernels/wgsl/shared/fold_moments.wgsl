// `bending_forces`, the second part: what a patch asks of its folds.
fn fold_moments(number: u32) {
    let damping = bending_damping(number);
    let start = 2u * (model.fold_count + 1u);
    var curvature = vec3f(0.0);
    for (var k = 0u; k < PATCH_FOLDS; k += 1u) {
        let fold = 2u * patch_fold(number, k);
        let bent = fma(damping, fold_numbers[fold + 1u], fold_numbers[fold]);
        let rest = bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_FOLDS + k]);
        curvature = fma(vec3f(bent), rest.yzw, curvature);
    }
    let moment = plate_moment(number, curvature);
    for (var k = 0u; k < PATCH_FOLDS; k += 1u) {
        let rest = bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_FOLDS + k]);
        fold_numbers[start + k * model.element_count + number] = dot_product(rest.yzw, moment);
    }
}
