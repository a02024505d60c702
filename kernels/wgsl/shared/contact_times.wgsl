// NUMERICS section 15, contact_linearise: a contact of triangles times a vector.

// S sum w_b v_b of the contact that begins at `at`.
fn contact_times(at: u32, vector: u32) -> vec3f {
    var relative = contact_number(at + 4u) * vector_get(vector, contact_table[at]);
    for (var b = 1u; b < 4u; b += 1u) {
        relative = add_scaled(relative, contact_number(at + 4u + b), vector_get(vector, contact_table[at + b]));
    }
    return symmetric_apply(Symmetric(contact_three(at + 8u), contact_three(at + 11u)), relative);
}
