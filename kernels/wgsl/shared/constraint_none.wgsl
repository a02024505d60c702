// No collider constrains anything. `constraint.wgsl` is the other half of this choice.

fn constraint_filter_of(particle: u32) -> Symmetric {
    return Symmetric(vec3f(1.0), vec3f(0.0));
}

fn constraint_count(particle: u32) -> u32 {
    return 0u;
}

fn constraint_change(particle: u32, velocity: vec3f) -> vec3f {
    return vec3f(0.0);
}
