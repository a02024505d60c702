// There is no fabric. `element_own.wgsl` is the other half of this choice.

fn element_own(particle: u32) -> f32 {
    return 0.0;
}
