// NUMERICS section 5, conjugate gradient, before the first half of an iteration where particles are in many contacts of triangles: the terms of all rows times c. A
// contact is in up to four rows: this way each contact is worked out once, and a long row waits for nothing but numbers side by side.
//!include model vectors symmetric contact_table contact_times contact_terms solve

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let contact = particle_index(id, groups);
    if contact >= contact_table[2] || solve.next.phase != SOLVE_RUNNING {
        return;
    }
    let at = contact_of(4u * contact);
    let times = contact_times(at, VECTOR_PRECONDITIONED);
    for (var a = 0u; a < 4u; a += 1u) {
        let weight = contact_number(at + 4u + a);
        if weight != 0.0 {
            contact_terms[contact_table[at + RANKS + a]] = vec4f(weight * times, 0.0);
        }
    }
}
