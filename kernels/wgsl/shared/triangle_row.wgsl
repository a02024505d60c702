// NUMERICS section 15, contact_linearise: contacts of triangles as part of the matrix, blocks w_a w_b S.

// S sum w_b v_b of the contact that begins at `at`.
fn contact_times(at: u32, vector: u32) -> vec3f {
    var relative = contact_number(at + 4u) * vector_get(vector, contact_table[at]);
    for (var b = 1u; b < 4u; b += 1u) {
        relative = add_scaled(relative, contact_number(at + 4u + b), vector_get(vector, contact_table[at + b]));
    }
    return symmetric_apply(Symmetric(contact_three(at + 8u), contact_three(at + 11u)), relative);
}

fn triangle_row(start: vec3f, particle: u32, vector: u32) -> vec3f {
    var sum = vec3f(0.0);
    let places = contact_places(particle);
    for (var k = places.x; k < places.y; k += 1u) {
        let place = contact_table[k];
        let at = contact_of(place);
        sum = add_scaled(sum, contact_weight(at, place), contact_times(at, vector));
    }
    return start + sum;
}
