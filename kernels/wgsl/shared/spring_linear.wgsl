// NUMERICS section 2: tension and energy of springs none of which buckles. `spring_buckling.wgsl` is the
// other half of this choice.

// Places that a spring takes in `spring_entries`.
const SPRING_WORDS: u32 = 1u;

// Elastic tension [N] of the spring at `at`.
fn elastic_tension(at: u32, stiffness: f32, stretch: f32) -> f32 {
    return stiffness * stretch;
}

// Its derivative by the length [N/m].
fn elastic_slope(at: u32, stiffness: f32, stretch: f32) -> f32 {
    return stiffness;
}

// Twice its energy [J].
fn elastic_energy_doubled(at: u32, stiffness: f32, stretch: f32) -> f32 {
    return stiffness * stretch * stretch;
}
