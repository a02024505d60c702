// No collider is such that a particle could pass it.

fn start_of(particle: u32, now: vec3f) -> vec3f {
    return now;
}
