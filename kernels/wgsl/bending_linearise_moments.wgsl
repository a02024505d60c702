// NUMERICS section 12, bending_linearise: what all patches ask of their folds, as impulses, after the first part of bending_forces and before the third.
//!include model substep status call fabric plate fold_tables fold_numbers fold_moments

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number < model.element_count && !is_stopped() {
        let length = substep.length;
        fold_moments(number, length, length, select(length * length, 0.0, call_has(CALL_ITERATE)));
    }
}
