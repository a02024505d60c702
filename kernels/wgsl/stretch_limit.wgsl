// NUMERICS section 4: shortens the over-stretched triangles of fabric of one colour, in place. They share no particle.
//!include model status substep motion_out colour fabric membrane

// Triangles, by colour.
@group(0) @binding(79) var<storage, read> limited_triangles: array<u32>;

// Share of the largest inverse mass with which a direction counts at least.
const LEAST_SHARE: f32 = 0.1;

// How much of `along` a corner moves for each of its inverse mass and its gradient along (x, y) of the pattern, so that this stretch ends at the
// largest one; 0 if it is not longer.
struct Shortening {
    along: vec3f,
    // Gradients of the corners.
    gradients: vec3f,
    scale: f32,
}

fn shortening(f: Gradient, inverse: vec4f, inverse_masses: vec3f, direction: vec2f, square: f32) -> Shortening {
    let second = dot(inverse.xy, direction);
    let third = dot(inverse.zw, direction);
    let gradients = vec3f(-(second + third), second, third);
    let along = combination(f.u, direction.x, f.v, direction.y);
    let squares = gradients * gradients;
    let largest = max(max(inverse_masses.x, inverse_masses.y), inverse_masses.z);
    let least = LEAST_SHARE * largest * (squares.x + squares.y + squares.z);
    let total = max(dot_product(inverse_masses, squares), least);
    if square <= colour.ratio * colour.ratio || total <= 0.0 {
        return Shortening(along, gradients, 0.0);
    }
    let stretch = sqrt(square);
    return Shortening(along, gradients, (stretch - colour.ratio) / total / stretch);
}

fn shift(particle: u32, by: vec3f) {
    let position = position_out[particle];
    let velocity = velocity_out[particle];
    position_out[particle] = vec4f(position.xyz + by, position.w);
    velocity_out[particle] = vec4f(velocity.xyz + by / substep.length, velocity.w);
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let place = particle_index(id, groups);
    if place >= colour.count || is_stopped() {
        return;
    }
    let triangle = membrane_of(limited_triangles[colour.first + place]);
    let a = position_out[triangle.particles.x];
    let b = position_out[triangle.particles.y];
    let c = position_out[triangle.particles.z];
    let f = deformation(a.xyz, b.xyz, c.xyz, triangle.inverse);
    let squares = vec3f(dot_product(f.u, f.u), dot_product(f.v, f.v), dot_product(f.u, f.v));
    let mean = 0.5 * (squares.x + squares.y);
    let apart = 0.5 * (squares.x - squares.y);
    let radius = sqrt(fma(apart, apart, squares.z * squares.z));
    if mean + radius <= colour.ratio * colour.ratio {
        return;
    }
    // Of two forms of the eigenvector the one that does not cancel.
    let long = select(vec2f(squares.z, radius - apart), vec2f(radius + apart, squares.z), apart >= 0.0);
    let length = sqrt(dot(long, long));
    let direction = select(vec2f(1.0, 0.0), long / length, length > 0.0);
    let inverse_masses = vec3f(a.w, b.w, c.w);
    let first = shortening(f, triangle.inverse, inverse_masses, direction, mean + radius);
    let across = vec2f(-direction.y, direction.x);
    let second = shortening(f, triangle.inverse, inverse_masses, across, mean - radius);
    let of_first = -first.scale * (inverse_masses * first.gradients);
    let of_second = -second.scale * (inverse_masses * second.gradients);
    shift(triangle.particles.x, of_first.x * first.along + of_second.x * second.along);
    shift(triangle.particles.y, of_first.y * first.along + of_second.y * second.along);
    shift(triangle.particles.z, of_first.z * first.along + of_second.z * second.along);
}
