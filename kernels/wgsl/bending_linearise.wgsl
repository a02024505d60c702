// NUMERICS section 12: derivatives of the curvatures of triangles of fabric, and their impulses.
//!include model substep status call motion fabric arctangent fold plate curvature fabric_vectors bending_store fabric_tangents

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number >= model.element_count || is_stopped() {
        return;
    }
    let length = substep.length;
    let damped = length * bending_damping(number);
    let weight = fma(length, length, damped);
    let along = select(weight, damped, call_has(CALL_ITERATE));
    var folds: array<Fold, PATCH_FOLDS>;
    bending_store(number, curvature_of(number, length, along, &folds), &folds);
    let at = number * TANGENT_WORDS + TANGENT_CURVATURES;
    fabric_tangents[number * TANGENT_WORDS + TANGENT_WEIGHT] = weight;
    for (var row = 0u; row < 3u; row += 1u) {
        var share = vec3f(0.0);
        share[row] = 1.0;
        var sums = folds_sum(number, share, &folds);
        for (var place = 0u; place < PATCH_VERTICES; place += 1u) {
            tangent_set(at + 9u * place + 3u * row, sums[place]);
        }
    }
}
