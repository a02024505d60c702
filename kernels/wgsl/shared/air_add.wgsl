// The force with that of the air added [N].
fn air_add(sum: vec3f, particle: u32) -> vec3f {
    return sum + air_force(particle);
}
