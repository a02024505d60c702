// What never changes while a model is simulated.

struct Model {
    // Gravity and uniform fields together [m/s^2].
    acceleration: vec3f,
    particle_count: u32,
    // All drag fields together [1/s].
    drag_rate: vec3f,
    // Half the thickness of the cloth [m]; negative if it differs, see `offsets`.
    offset: f32,
    // Coefficients of contact between cloths.
    contact_distance: f32,
    contact_stiffness: f32,
    contact_damping: f32,
    contact_restitution: f32,
    contact_friction: f32,
    // Whether the fused substep ends with colliders, as nothing comes between.
    colliders_in_pass: u32,
    // Number of workgroups of the stage `measure`, those over triangles of fabric included.
    measure_blocks: u32,
    // Workgroups of the linear solvers, and particles of each of their threads.
    solve_blocks: u32,
    solve_repeats: u32,
    // Always 0, which no compiler knows.
    zero: u32,
    // Triangles of fabric, and folds.
    element_count: u32,
    fold_count: u32,
}

@group(0) @binding(0) var<uniform> model: Model;

// Lengths below this count as this in a division (NUMERICS section 2).
const LENGTH_MIN: f32 = 1e-18;

// The loop over particles of all stages. A grid of workgroups has two dimensions, as one holds no
// more than 65,535 of them; what lies beyond the last particle does nothing.
const WORKGROUP: u32 = 64u;

fn particle_index(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.x + id.y * groups.x * WORKGROUP;
}

// A sum of products in a fixed order. Products that are added to something are written as `fma`
// everywhere: then no compiler has a choice of what to contract, and a function gives the same bits
// in every stage that it is part of.
fn dot_product(a: vec3f, b: vec3f) -> f32 {
    return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}

fn cross_product(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(
        fma(a.y, b.z, -(a.z * b.y)),
        fma(a.z, b.x, -(a.x * b.z)),
        fma(a.x, b.y, -(a.y * b.x)),
    );
}

// a + scale b.
fn add_scaled(a: vec3f, scale: f32, b: vec3f) -> vec3f {
    return fma(vec3f(scale), b, a);
}
