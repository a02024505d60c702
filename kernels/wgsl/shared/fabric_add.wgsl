// The force with those of triangles of fabric added [N].
fn fabric_add(sum: vec3f, particle: u32) -> vec3f {
    return sum + membrane_force(particle) + bending_force(particle);
}
