// There is no fabric. `element_pull.wgsl` is the other half of this choice.

fn element_pull(start: vec3f, particle: u32, velocity: vec3f) -> vec3f {
    return start;
}
