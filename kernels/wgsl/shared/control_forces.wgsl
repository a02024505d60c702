// Forces on single particles, given while a simulation runs; each particle at most once.

struct ControlForce {
    // Constant force [N].
    force: vec3f,
    particle: u32,
    // Place of the anchor without its offset [m].
    anchor: vec3f,
    // Of the spring [N/m].
    stiffness: f32,
    // Velocity before the last kick [m/s].
    before: vec3f,
    // Of the spring [N s/m].
    damping: f32,
    // Longest distance from the anchor that counts [m].
    reach: f32,
    // Whether the anchor is where the particle is when the forces are given.
    is_here: u32,
    padding_0: u32,
    padding_1: u32,
}

// Their number, then the forces.
struct ControlForces {
    count: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    list: array<ControlForce>,
}

@group(0) @binding(57) var<storage, read_write> control_forces: ControlForces;

const FORCE_WORKGROUP: u32 = 64u;

fn control_force_place(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.x + id.y * groups.x * FORCE_WORKGROUP;
}
