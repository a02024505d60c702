// NUMERICS section 4: symplectic Euler.

struct Step {
    position: vec3f,
    velocity: vec3f,
}

fn integrate(position: vec3f, inverse_mass: f32, velocity: vec3f, force: vec3f) -> Step {
    let after = fma(vec3f(substep.length * inverse_mass), force, velocity);
    return Step(fma(vec3f(substep.length), after, position), after);
}
