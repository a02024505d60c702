// NUMERICS section 12, bending_linearise: what each fold adds to the matrix, after the first part of bending_forces.
//!include model substep status arctangent fold fold_tables fold_numbers fold_apexes fabric_tangents

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number >= model.fold_count || is_stopped() {
        return;
    }
    let fold = fold_apexes(number);
    let length = substep.length;
    let root = sqrt(fma(length * length, fold_stiffness(number), length * fold_damping(number)));
    let at = 4u * (model.element_count + number);
    fabric_tangents[at] = vec4f(root * fold_start(fold), 0.0);
    fabric_tangents[at + 1u] = vec4f(root * fold_end(fold), 0.0);
    fabric_tangents[at + 2u] = vec4f(root * fold.apex, 0.0);
    fabric_tangents[at + 3u] = vec4f(root * fold.beyond, 0.0);
}
