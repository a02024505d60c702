// Nobody asks what colliders do.

fn impulse_add(particle: u32, collider: u32, mass: f32, before: vec3f, after: Moved) {
}
