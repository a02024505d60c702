// There is no air. `air_jacobian.wgsl` is the other half of this choice.

fn air_jacobian(particle: u32) -> Symmetric {
    return Symmetric(vec3f(0.0), vec3f(0.0));
}
