// NUMERICS section 15, contact_linearise: contacts of triangles as part of the matrix, blocks w_a w_b S.

// Four contacts at a time, so that the device waits once for what they read; what lies beyond the row is read again and left out.
fn triangle_row(start: vec3f, particle: u32, vector: u32) -> vec3f {
    var sum = vec3f(0.0);
    let places = contact_places(particle);
    for (var k = places.x; k < places.y; k += 4u) {
        let last = places.y - 1u;
        let a = contact_table[k];
        let b = contact_table[min(k + 1u, last)];
        let c = contact_table[min(k + 2u, last)];
        let d = contact_table[min(k + 3u, last)];
        let times_a = contact_times(contact_of(a), vector);
        let times_b = contact_times(contact_of(b), vector);
        let times_c = contact_times(contact_of(c), vector);
        let times_d = contact_times(contact_of(d), vector);
        sum = add_scaled(sum, contact_weight(contact_of(a), a), times_a);
        sum = select(sum, add_scaled(sum, contact_weight(contact_of(b), b), times_b), k + 1u < places.y);
        sum = select(sum, add_scaled(sum, contact_weight(contact_of(c), c), times_c), k + 2u < places.y);
        sum = select(sum, add_scaled(sum, contact_weight(contact_of(d), d), times_d), k + 3u < places.y);
    }
    return start + sum;
}
