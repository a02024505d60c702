// NUMERICS section 7: what each collider did to each particle since the host asked. Entry 2 (c n + i) is the
// impulse of collider c on particle i [kg m/s], the next one its moment about the origin [kg m^2/s].

@group(0) @binding(55) var<storage, read_write> collider_impulses: array<vec4f>;

// Adds what a collider did to a particle: `mass` times `change`, at a place.
fn impulse_add(particle: u32, collider: u32, mass: f32, change: vec3f, position: vec3f) {
    if all(change == vec3f(0.0)) {
        return;
    }
    let at = 2u * (collider * model.particle_count + particle);
    collider_impulses[at] = vec4f(add_scaled(collider_impulses[at].xyz, mass, change), 0.0);
    let moment = cross_product(position, change);
    collider_impulses[at + 1u] = vec4f(add_scaled(collider_impulses[at + 1u].xyz, mass, moment), 0.0);
}
