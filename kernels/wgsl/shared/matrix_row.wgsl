// NUMERICS section 5, matrix_apply: a row of A times a vector.

fn matrix_row(particle: u32, vector: u32) -> vec3f {
    let own = vector_get(vector, particle);
    let base = Symmetric(matrix_base[2u * particle].xyz, matrix_base[2u * particle + 1u].xyz);
    var sum = symmetric_apply(base, own);
    let row = link_row(particle);
    for (var at = row.first; at < row.end; at += row.stride) {
        let entry = link_entries[at];
        let factor = factors[entry.y + particle];
        let difference = own - vector_get(vector, particle + entry.x);
        let along = dot_product(factor.xyz, difference);
        sum = add_scaled(add_scaled(sum, max(factor.w, 0.0), difference), along, factor.xyz);
    }
    return contact_row(sum, particle, vector, own);
}
