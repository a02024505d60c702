// All forces on a particle but those of contact with other particles [N].
fn particle_force(particle: u32, position: vec4f, velocity: vec4f) -> vec3f {
    var sum = field_force(velocity.w, velocity.xyz);
    sum = procedural_force(sum, particle, position.xyz, velocity.xyz, velocity.w);
    sum = spring_force(sum, particle, position.xyz, velocity.xyz);
    return air_add(fabric_add(sum, particle), particle);
}
