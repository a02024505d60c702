// NUMERICS section 12: the forces of folded triangles of fabric on the vertices of their patches.
//!include model status motion fabric arctangent fold fabric_vectors bending_store bending_element

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number < model.element_count && !is_stopped() {
        bending_element(number);
    }
}
