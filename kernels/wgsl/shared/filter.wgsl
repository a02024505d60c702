// NUMERICS section 5: S.

// What the filter of a particle with this inverse mass does, a FILTER_ constant.
fn filter_kind_now(particle: u32, inverse_mass: f32) -> f32 {
    if !(inverse_mass > 0.0) {
        return FILTER_HELD;
    }
    return select(FILTER_FREE, FILTER_CONSTRAINED, constraint_count(particle) > 0u);
}

// S y
fn filtered(particle: u32, kind: f32, y: vec3f) -> vec3f {
    if kind == FILTER_FREE {
        return y;
    }
    if kind == FILTER_CONSTRAINED {
        return symmetric_apply(constraint_filter_of(particle), y);
    }
    return vec3f(0.0);
}
