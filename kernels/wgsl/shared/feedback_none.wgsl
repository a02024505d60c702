// Nobody asks what colliders do.

fn impulse_add(particle: u32, collider: u32, mass: f32, change: vec3f, position: vec3f) {
}
