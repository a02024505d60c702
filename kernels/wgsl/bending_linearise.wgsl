// NUMERICS section 12, bending_linearise: the tangent of every patch, after the first part of bending_forces. A thread for each of its three vectors.
//!include model substep status fabric arctangent fold plate fold_tables fold_numbers fold_apexes fabric_tangents

// The places in the patch of the vertices of a fold: start and end of the edge, third vertex, the one beyond. Three bits for each fold, the first one last: of
// the edges ab, bc, ca, and for each of these of the triangle beyond, from the edge's start to its apex and from there to its end.
fn fold_places(number: u32) -> vec4<u32> {
    let bits = vec3<u32>(0x550b088u, 0xaa1611u, 0x2050242u) >> vec3<u32>(3u * number);
    return vec4<u32>(bits & vec3<u32>(7u), 3u + number);
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let index = particle_index(id, groups);
    if index >= 3u * model.element_count || is_stopped() {
        return;
    }
    let number = index % model.element_count;
    let row = index / model.element_count;
    let length = substep.length;
    let weight = sqrt(fma(length, length, length * bending_damping(number)));
    var sums: array<vec3f, PATCH_VERTICES>;
    for (var k = 0u; k < PATCH_FOLDS; k += 1u) {
        let name = patch_fold(number, k);
        let fold = fold_apexes(name & ~TURNED);
        let own = fold_places(k);
        let places = select(own, own.yxwz, (name & TURNED) != 0u);
        let share = vec3f(weight * patch_map(number, k)[row]);
        sums[places.x] = fma(share, fold_start(fold), sums[places.x]);
        sums[places.y] = fma(share, fold_end(fold), sums[places.y]);
        sums[places.z] = fma(share, fold.apex, sums[places.z]);
        sums[places.w] = fma(share, fold.beyond, sums[places.w]);
    }
    for (var place = 0u; place < PATCH_VERTICES; place += 1u) {
        let particle = patch_particle(number, place);
        if (particle & COMES_AGAIN) != 0u {
            sums[particle & ~COMES_AGAIN] += sums[place];
            sums[place] = vec3f(0.0);
        }
    }
    let at = number * TANGENT_WORDS + TANGENT_PATCH + 3u * row;
    for (var place = 0u; place < PATCH_VERTICES; place += 1u) {
        tangent_set(at + 9u * place, sums[place]);
    }
}
