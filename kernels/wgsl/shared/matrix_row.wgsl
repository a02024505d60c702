// NUMERICS section 5, matrix_apply: a row of A times a vector.

// Eight springs at a time, so that the device waits once for what they read; what lies beyond the row is read
// again and left out.
fn matrix_row(particle: u32, vector: u32) -> vec3f {
    let own = vector_get(vector, particle);
    let base = Symmetric(matrix_base[2u * particle].xyz, matrix_base[2u * particle + 1u].xyz);
    var sum = symmetric_apply(base, own);
    let row = link_row(particle);
    let last = row.end - row.stride;
    let first = vector * model.particle_count + particle;
    for (var at_a = row.first; at_a < row.end; at_a += 8u * row.stride) {
        let at_b = at_a + row.stride;
        let at_c = at_b + row.stride;
        let at_d = at_c + row.stride;
        let at_e = at_d + row.stride;
        let at_f = at_e + row.stride;
        let at_g = at_f + row.stride;
        let at_h = at_g + row.stride;
        let a = link_entries[at_a];
        let b = link_entries[min(at_b, last)];
        let c = link_entries[min(at_c, last)];
        let d = link_entries[min(at_d, last)];
        let e = link_entries[min(at_e, last)];
        let f = link_entries[min(at_f, last)];
        let g = link_entries[min(at_g, last)];
        let h = link_entries[min(at_h, last)];
        let factor_a = factors[a.y + particle];
        let factor_b = factors[b.y + particle];
        let factor_c = factors[c.y + particle];
        let factor_d = factors[d.y + particle];
        let factor_e = factors[e.y + particle];
        let factor_f = factors[f.y + particle];
        let factor_g = factors[g.y + particle];
        let factor_h = factors[h.y + particle];
        let other_a = vectors[first + a.x].xyz;
        let other_b = vectors[first + b.x].xyz;
        let other_c = vectors[first + c.x].xyz;
        let other_d = vectors[first + d.x].xyz;
        let other_e = vectors[first + e.x].xyz;
        let other_f = vectors[first + f.x].xyz;
        let other_g = vectors[first + g.x].xyz;
        let other_h = vectors[first + h.x].xyz;
        sum = matrix_entry(sum, factor_a, own - other_a);
        sum = select(sum, matrix_entry(sum, factor_b, own - other_b), at_b < row.end);
        sum = select(sum, matrix_entry(sum, factor_c, own - other_c), at_c < row.end);
        sum = select(sum, matrix_entry(sum, factor_d, own - other_d), at_d < row.end);
        sum = select(sum, matrix_entry(sum, factor_e, own - other_e), at_e < row.end);
        sum = select(sum, matrix_entry(sum, factor_f, own - other_f), at_f < row.end);
        sum = select(sum, matrix_entry(sum, factor_g, own - other_g), at_g < row.end);
        sum = select(sum, matrix_entry(sum, factor_h, own - other_h), at_h < row.end);
    }
    return contact_row(sum, particle, vector, own);
}
