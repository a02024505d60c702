// NUMERICS section 5: what colliders demand of the velocity of a particle.

// Contact with one collider.
struct Touch {
    normal: vec3f,
    // Velocity along the normal [m/s].
    speed: f32,
    // Velocity of the collider [m/s].
    surface: vec3f,
    friction: f32,
    // Friction as a drag along the surface [kg], if the contact slides.
    drag: f32,
    // Whether friction holds the particle.
    sticks: u32,
    // Number of the collider.
    collider: u32,
    padding: u32,
}

const TOUCHES_MAX: u32 = 4u;
// Slower slip [m/s] counts as this much, so that drags stay finite.
const SLIP_MIN: f32 = 1e-4;

struct Constraint {
    // S: xx, yy, zz.
    filter_on: vec3f,
    // Contacts.
    count: u32,
    // S: xy, xz, yz.
    filter_off: vec3f,
    padding_0: u32,
    // The velocity in the constrained directions [m/s].
    velocity: vec3f,
    padding_1: u32,
    touches: array<Touch, TOUCHES_MAX>,
}

@group(0) @binding(42) var<storage, read_write> constraints: array<Constraint>;

fn constraint_filter_of(particle: u32) -> Symmetric {
    return Symmetric(constraints[particle].filter_on, constraints[particle].filter_off);
}

fn constraint_count(particle: u32) -> u32 {
    return constraints[particle].count;
}

// z for a particle with this velocity.
fn constraint_change(particle: u32, velocity: vec3f) -> vec3f {
    let change = constraints[particle].velocity - velocity;
    return change - symmetric_apply(constraint_filter_of(particle), change);
}
