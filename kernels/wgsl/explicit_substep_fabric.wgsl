// The forces of triangles of fabric, which the composite stage sums: both stages in one kernel.
//!include model status motion fabric membrane membrane_motion arctangent fold fabric_vectors membrane_store membrane_element bending_store bending_element

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number < model.element_count && !is_stopped() {
        membrane_element(number);
        bending_element(number);
    }
}
