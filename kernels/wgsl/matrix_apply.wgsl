// NUMERICS section 5: to = A from.
//!include model status call vectors symmetric links matrix matrix_entry matrix_springs matrix_row
//!if penalty
//!include contact_row
//!end
//!if not penalty
//!include contact_row_none
//!end
//!if triangles
//!include contact_table contact_times triangle_row
//!end
//!if not triangles
//!include triangle_row_none
//!end
//!if fabric
//!include element_row
//!end
//!if not fabric
//!include element_row_none
//!end

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    vector_set(call.vector_to, particle, matrix_row(particle, call.vector_from));
}
