// No triangle of fabric is part of the matrix. `element_row.wgsl` is the other half of this choice.

fn element_row(start: vec3f, particle: u32, vector: u32, own: vec3f) -> vec3f {
    return start;
}
