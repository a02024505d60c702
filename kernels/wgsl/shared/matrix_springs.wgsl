// NUMERICS section 5, matrix_apply: a row of A times a vector, but for contacts.

// `row_vector(place + d)` is the vector of particle + d, `own` that of the particle. Eight springs at a time, so that the
// device waits once for what they read; what lies beyond the row is read again and left out.
fn matrix_springs(particle: u32, place: u32, own: vec3f) -> vec3f {
    let base = Symmetric(matrix_base[2u * particle].xyz, matrix_base[2u * particle + 1u].xyz);
    var sum = symmetric_apply(base, own);
    let row = link_row(particle);
    let last = row.end - row.stride;
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
        let other_a = row_vector(place + a.x);
        let other_b = row_vector(place + b.x);
        let other_c = row_vector(place + c.x);
        let other_d = row_vector(place + d.x);
        let other_e = row_vector(place + e.x);
        let other_f = row_vector(place + f.x);
        let other_g = row_vector(place + g.x);
        let other_h = row_vector(place + h.x);
        sum = matrix_entry(sum, factor_a, own - other_a);
        sum = select(sum, matrix_entry(sum, factor_b, own - other_b), at_b < row.end);
        sum = select(sum, matrix_entry(sum, factor_c, own - other_c), at_c < row.end);
        sum = select(sum, matrix_entry(sum, factor_d, own - other_d), at_d < row.end);
        sum = select(sum, matrix_entry(sum, factor_e, own - other_e), at_e < row.end);
        sum = select(sum, matrix_entry(sum, factor_f, own - other_f), at_f < row.end);
        sum = select(sum, matrix_entry(sum, factor_g, own - other_g), at_g < row.end);
        sum = select(sum, matrix_entry(sum, factor_h, own - other_h), at_h < row.end);
    }
    return sum;
}
