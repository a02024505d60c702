// The forces of triangles of fabric, which the composite stage sums: what stretched ones put at their corners, and what all ask of their folds.
//!include model status motion fabric membrane membrane_motion fabric_vectors membrane_store membrane_element plate fold_tables fold_numbers fold_moments

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number < model.element_count && !is_stopped() {
        membrane_element(number);
        fold_moments(number, 1.0, 1.0, 0.0);
    }
}
