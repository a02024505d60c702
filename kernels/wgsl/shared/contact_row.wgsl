// NUMERICS section 5: the pairs in contact as part of the matrix.

@group(0) @binding(17) var<storage, read> contact_rows: array<vec2<u32>>;
@group(0) @binding(18) var<storage, read> contact_entries: array<u32>;
// u, and whether the pair is in contact, for each candidate.
@group(0) @binding(45) var<storage, read> contact_factors: array<vec4f>;

fn contact_row(start: vec3f, particle: u32, vector: u32, own: vec3f) -> vec3f {
    var sum = start;
    let row = contact_rows[particle];
    for (var at = row.x; at < row.x + row.y; at += 1u) {
        let factor = contact_factors[at];
        if factor.w != 0.0 {
            let difference = own - vector_get(vector, contact_entries[at]);
            sum = add_scaled(sum, dot_product(factor.xyz, difference), factor.xyz);
        }
    }
    return sum;
}
