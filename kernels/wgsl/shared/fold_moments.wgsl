// Three numbers [J^(1/2)], half the sum of whose squares is the energy of a patch, for folds that are `still` times as far from rest as they are, and
// `moving` times their rates.
fn energy_roots(number: u32, still: f32, moving: f32) -> vec3f {
    var roots = vec3f(0.0);
    for (var k = 0u; k < PATCH_FOLDS; k += 1u) {
        let fold = 2u * patch_fold(number, k);
        let bent = fma(moving, fold_numbers[fold + 1u], still * fold_numbers[fold]);
        roots = fma(vec3f(bent), patch_map(number, k), roots);
    }
    return roots;
}

// `bending_forces`, the second part: what a patch asks of its folds. Rates count `moving` times the damping of the patch, and `ahead` more.
fn fold_moments(number: u32, still: f32, moving: f32, ahead: f32) {
    let start = 2u * (model.fold_count + 1u);
    let roots = energy_roots(number, still, fma(moving, bending_damping(number), ahead));
    for (var k = 0u; k < PATCH_FOLDS; k += 1u) {
        fold_numbers[start + k * model.element_count + number] = dot_product(patch_map(number, k), roots);
    }
}
