// NUMERICS section 5, matrix_apply: a row of A times a vector.

// The sum with one spring more.
fn matrix_entry(sum: vec3f, factor: vec4f, difference: vec3f) -> vec3f {
    let along = dot_product(factor.xyz, difference);
    return add_scaled(add_scaled(sum, max(factor.w, 0.0), difference), along, factor.xyz);
}

// Four springs at a time, so that the device waits once for what they read; what lies beyond the row is read
// again and left out.
fn matrix_row(particle: u32, vector: u32) -> vec3f {
    let own = vector_get(vector, particle);
    let base = Symmetric(matrix_base[2u * particle].xyz, matrix_base[2u * particle + 1u].xyz);
    var sum = symmetric_apply(base, own);
    let row = link_row(particle);
    let last = row.end - row.stride;
    let first = vector * model.particle_count + particle;
    for (var at = row.first; at < row.end; at += 4u * row.stride) {
        let places = vec4<u32>(at, at + row.stride, at + 2u * row.stride, at + 3u * row.stride);
        let inside = min(places, vec4<u32>(last));
        let a = link_entries[inside.x];
        let b = link_entries[inside.y];
        let c = link_entries[inside.z];
        let d = link_entries[inside.w];
        let factor_a = factors[a.y + particle];
        let factor_b = factors[b.y + particle];
        let factor_c = factors[c.y + particle];
        let factor_d = factors[d.y + particle];
        let other_a = vectors[first + a.x].xyz;
        let other_b = vectors[first + b.x].xyz;
        let other_c = vectors[first + c.x].xyz;
        let other_d = vectors[first + d.x].xyz;
        sum = matrix_entry(sum, factor_a, own - other_a);
        sum = select(sum, matrix_entry(sum, factor_b, own - other_b), places.y < row.end);
        sum = select(sum, matrix_entry(sum, factor_c, own - other_c), places.z < row.end);
        sum = select(sum, matrix_entry(sum, factor_d, own - other_d), places.w < row.end);
    }
    return contact_row(sum, particle, vector, own);
}
