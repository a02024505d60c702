// NUMERICS section 12, bending_forces, the second part: what all patches ask of their folds.
//!include model status fabric plate fold_tables fold_numbers fold_moments

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number < model.element_count && !is_stopped() {
        fold_moments(number, 1.0, 1.0, 0.0);
    }
}
