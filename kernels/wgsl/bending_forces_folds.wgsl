// NUMERICS section 12, bending_forces, the first part: how far each fold is from rest, how fast it folds, and of what its derivatives consist.
//!include model status motion arctangent fold fold_tables fold_numbers fold_apexes

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number >= model.fold_count || is_stopped() {
        return;
    }
    let at = fold_vertices(number);
    let now = fold_of(position_in[at.x].xyz, position_in[at.y].xyz, position_in[at.z].xyz, position_in[at.w].xyz);
    let ends = dot_product(fold_start(now.fold), velocity_in[at.x].xyz) + dot_product(fold_end(now.fold), velocity_in[at.y].xyz);
    let third = dot_product(now.fold.apex, velocity_in[at.z].xyz);
    fold_apexes_set(number, now.fold);
    fold_numbers[2u * number] = angle_difference(now.angle, fold_rest(number));
    fold_numbers[2u * number + 1u] = ends + third + dot_product(now.fold.beyond, velocity_in[at.w].xyz);
}
