// No contact of triangles is part of the matrix. `triangle_row.wgsl` is the other half of this choice.

fn triangle_row(start: vec3f, particle: u32, vector: u32) -> vec3f {
    return start;
}
