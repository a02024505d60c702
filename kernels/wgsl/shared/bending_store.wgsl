// At each vertex of a patch the sum of the derivatives of its folds, each times `share` . (k11, k22, k12) of the fold.
fn folds_sum(number: u32, share: vec3f, folds: ptr<function, array<Fold, PATCH_FOLDS>>) -> array<vec3f, PATCH_VERTICES> {
    var sums: array<vec3f, PATCH_VERTICES>;
    for (var k = 0u; k < PATCH_FOLDS; k += 1u) {
        let places = fold_places(k);
        let rest = bitcast<vec4f>(fabric_elements[number * ELEMENT_WORDS + ELEMENT_FOLDS + k]);
        let scale = vec3f(dot_product(rest.yzw, share));
        let fold = (*folds)[k];
        sums[places.x] = fma(scale, fold_start(fold), sums[places.x]);
        sums[places.y] = fma(scale, fold_end(fold), sums[places.y]);
        sums[places.z] = fma(scale, fold.apex, sums[places.z]);
        sums[places.w] = fma(scale, fold.beyond, sums[places.w]);
    }
    return sums;
}

// What a folded triangle puts at the vertices of its patch: minus the sums of moment times derivative, the moments of the folds being those of a curvature.
fn bending_store(number: u32, curvature: vec3f, folds: ptr<function, array<Fold, PATCH_FOLDS>>) {
    let at = 3u * model.element_count + PATCH_VERTICES * number;
    var forces = folds_sum(number, -plate_moment(number, curvature), folds);
    for (var place = 0u; place < PATCH_VERTICES; place += 1u) {
        fabric_vector_set(at + place, forces[place]);
    }
}
