// NUMERICS section 15, contact_linearise: contacts of triangles as part of the matrix.

fn triangle_row(start: vec3f, particle: u32, vector: u32) -> vec3f {
    return start + triangle_sum(particle, vector);
}
