// NUMERICS section 3: procedural fields. This part is for models that have none; for others the backend
// puts the functions of their programs in its place.

// The force with those of all procedural fields added [N].
fn procedural_force(force: vec3f, particle: u32, position: vec3f, velocity: vec3f, mass: f32) -> vec3f {
    return force;
}
