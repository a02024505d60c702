// No pair in contact is part of the matrix. `contact_row.wgsl` is the other half of this choice.

fn contact_row(start: vec3f, particle: u32, vector: u32, own: vec3f) -> vec3f {
    return start;
}
