// NUMERICS section 12, bending_forces, the third part: what patches ask of each fold, on its vertices. Behind the vectors of triangles there is one for each vertex.
//!include model status arctangent fold fold_tables fold_numbers fold_apexes fabric_vectors

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number >= model.fold_count || is_stopped() {
        return;
    }
    var moment = 0.0;
    for (var k = 0u; k < FOLD_PLACES_MAX; k += 1u) {
        moment += fold_numbers[fold_place(number, k)];
    }
    let fold = fold_apexes(number);
    let place = 3u * model.element_count + 4u * number;
    fabric_vector_set(place, -moment * fold_start(fold));
    fabric_vector_set(place + 1u, -moment * fold_end(fold));
    fabric_vector_set(place + 2u, -moment * fold.apex);
    fabric_vector_set(place + 3u, -moment * fold.beyond);
}
