// NUMERICS section 5, implicit_assemble: the parts of B, D and b.

// What springs add to D, and b.
struct Parts {
    diagonal: Symmetric,
    right_side: vec3f,
}

// How a spring pulls: differences of velocity and position to its other end, factors of u and of the first one.
struct SpringPull {
    relative: vec3f,
    difference: vec3f,
    along: f32,
    across: f32,
}

// B of a particle that no collider touches.
fn base_of(mass: f32, air: Symmetric) -> Symmetric {
    let length = substep.length;
    return Symmetric(
        fma(vec3f(length), air.on, mass * (vec3f(1.0) + length * model.drag_rate)),
        length * air.off,
    );
}

// The parts with one spring more.
fn spring_assemble(before: Parts, factor: vec4f, spring: SpringPull) -> Parts {
    let u = factor.xyz;
    var pull = fma(vec3f(spring.along), u, spring.across * spring.relative);
    pull = fma(vec3f(factor.w / substep.length), spring.difference, pull);
    var after = before;
    after.right_side += pull;
    after.diagonal.on += vec3f(max(factor.w, 0.0));
    after.diagonal = symmetric_add_outer(after.diagonal, 1.0, u);
    return after;
}

fn system_set(particle: u32, base: Symmetric, kind: f32, parts: Parts) {
    matrix_base[2u * particle] = vec4f(base.on, kind);
    matrix_base[2u * particle + 1u] = vec4f(base.off, 0.0);
    matrix_diagonal[2u * particle] = vec4f(base.on + parts.diagonal.on, 0.0);
    matrix_diagonal[2u * particle + 1u] = vec4f(base.off + parts.diagonal.off, 0.0);
    vector_set(VECTOR_RIGHT_SIDE, particle, parts.right_side);
}
