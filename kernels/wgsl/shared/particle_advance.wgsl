// The composite stage for one particle, made of the same functions as the single stages.

// The particle after the substep, in which `force` acts on it.
fn particle_advance(particle: u32, position: vec4f, velocity: vec4f, force: vec3f, is_over: bool) -> Moved {
    let step = integrate(position.xyz, position.w, velocity.xyz, force);
    var moved = Moved(step.position, step.velocity);
    if model.colliders_in_pass != 0u && substep.collider_count != 0u && position.w > 0.0 {
        moved = collide_all(particle, velocity.w, position.xyz, moved);
    }
    if is_over {
        moved = Moved(position.xyz, velocity.xyz);
    } else if !(is_finite(moved.position) && is_finite(moved.velocity)) {
        atomicMin(&status.stopped, substep.serial);
    }
    position_out[particle] = vec4f(moved.position, position.w);
    velocity_out[particle] = vec4f(moved.velocity, velocity.w);
    return moved;
}

// A number that is not finite may be found in this very substep, by another particle: only an earlier one stops
// it.
fn is_over() -> bool {
    return atomicLoad(&status.stopped) < substep.serial;
}
