// `bending_forces` of one triangle.
fn bending_element(number: u32) {
    var folds: array<Fold, PATCH_FOLDS>;
    let curvature = curvature_of(number, 1.0, bending_damping(number), &folds);
    bending_store(number, curvature, &folds);
}
