// NUMERICS section 5: the constraints that colliders put on velocities.
//!include model substep status motion collider symmetric constraint constraint_change solve feedback_none
//!if grids
//!include distance_grid
//!end
//!if not grids
//!include distance_grid_none
//!end

fn touch_of(number: u32, surface: Surface, gap: f32, mass: f32, x: vec3f, v: vec3f) -> Touch {
    let collider = colliders[substep.collider_first + number];
    let length = substep.length;
    let arm = x - collider.translation;
    let carried = surface_velocity(collider, surface, arm);
    let normal = surface.normal;
    let speed_surface = dot_product(carried, normal);
    let approach = dot_product(v, normal) - speed_surface;
    var speed = min(-gap / length, speed_surface);
    if approach < 0.0 && collider.restitution > 0.0 {
        speed = max(speed, fma(-collider.restitution, approach, speed_surface));
    }
    let relative = velocity_by_fields(v) - carried;
    let across = dot_product(relative, normal);
    let along = add_scaled(relative, -across, normal);
    let slip = sqrt(dot_product(along, along));
    let grip = collider.friction * (speed - (across + speed_surface));
    let sticks = slip <= grip;
    var drag = 0.0;
    if !sticks {
        // The fields may pull it off, which no friction resists.
        drag = max(mass * grip / max(slip - grip, SLIP_MIN), 0.0);
    }
    return Touch(normal, speed, carried, collider.friction, drag, u32(sticks), number, 0u);
}

// v*
fn velocity_by_fields(v: vec3f) -> vec3f {
    return fma(vec3f(substep.length), fma(-model.drag_rate, v, model.acceleration), v);
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let position = position_in[particle];
    let velocity = velocity_in[particle];
    var constraint: Constraint;
    constraint.filter_on = vec3f(1.0);
    if position.w > 0.0 {
        let predicted = velocity_by_fields(velocity.xyz);
        for (var number = 0u; number < substep.collider_count; number += 1u) {
            let collider = colliders[substep.collider_first + number];
            let surface = surface_of(collider, position.xyz - collider.translation);
            let gap = surface.distance - cloth_offset(particle);
            if -gap > substep.length * dot_product(surface.normal, predicted) && constraint.count < TOUCHES_MAX {
                constraint.touches[constraint.count] =
                    touch_of(number, surface, gap, velocity.w, position.xyz, velocity.xyz);
                constraint.count += 1u;
            }
        }
        if constraint.count > 0u {
            constraint_update(&constraint);
            if (substep.flags & FLAG_COUNT_CONTACTS) != 0u {
                atomicAdd(&solve.constrained, 1u);
            }
        }
    }
    if constraint.count > 0u {
        constraints[particle] = constraint;
    } else {
        constraints[particle].filter_on = constraint.filter_on;
        constraints[particle].filter_off = vec3f(0.0);
        constraints[particle].count = 0u;
        constraints[particle].velocity = velocity.xyz;
    }
}
