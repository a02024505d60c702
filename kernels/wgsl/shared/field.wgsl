// NUMERICS section 3: gravity, uniform fields, drag.

fn field_force(mass: f32, velocity: vec3f) -> vec3f {
    return mass * fma(-model.drag_rate, velocity, model.acceleration);
}
