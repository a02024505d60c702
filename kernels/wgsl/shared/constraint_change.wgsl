// NUMERICS section 5: filter and target velocity of a particle from its contacts; the drag of those that
// slide.

// A normal that has less than this outside of the directions constrained already adds nothing.
const DIRECTION_MIN: f32 = 1e-3;

// Directions that are constrained, orthonormal, and the velocity in them.
struct Span {
    directions: array<vec3f, 3>,
    count: u32,
    velocity: vec3f,
}

// Constrains the velocity along a direction as far as it is free.
fn span_add(span: ptr<function, Span>, direction: vec3f, speed: f32) {
    if (*span).count == 3u {
        return;
    }
    var rest = direction;
    for (var k = 0u; k < (*span).count; k += 1u) {
        let taken = (*span).directions[k];
        rest = add_scaled(rest, -dot_product(taken, direction), taken);
    }
    let length = sqrt(dot_product(rest, rest));
    if length < DIRECTION_MIN {
        return;
    }
    let unit = rest / length;
    let missing = (speed - dot_product(direction, (*span).velocity)) / length;
    (*span).velocity = add_scaled((*span).velocity, missing, unit);
    (*span).directions[(*span).count] = unit;
    (*span).count += 1u;
}

// Constrains what a contact constrains.
fn span_add_touch(span: ptr<function, Span>, touch: Touch) {
    span_add(span, touch.normal, touch.speed);
    if touch.sticks != 0u {
        let extra = touch.speed - dot_product(touch.surface, touch.normal);
        let wanted = add_scaled(touch.surface, extra, touch.normal);
        span_add(span, vec3f(1.0, 0.0, 0.0), wanted.x);
        span_add(span, vec3f(0.0, 1.0, 0.0), wanted.y);
        span_add(span, vec3f(0.0, 0.0, 1.0), wanted.z);
    }
}

// Filter and target from the contacts.
fn constraint_update(constraint: ptr<function, Constraint>) {
    var span: Span;
    for (var k = 0u; k < (*constraint).count; k += 1u) {
        span_add_touch(&span, (*constraint).touches[k]);
    }
    (*constraint).velocity = span.velocity;
    var free = Symmetric(vec3f(1.0), vec3f(0.0));
    if span.count == 3u {
        free.on = vec3f(0.0);
    } else {
        for (var k = 0u; k < span.count; k += 1u) {
            free = symmetric_add_outer(free, -1.0, span.directions[k]);
        }
    }
    (*constraint).filter_on = free.on;
    (*constraint).filter_off = free.off;
}

// c (I - n n^T) of a contact that slides.
fn touch_drag(touch: Touch) -> Symmetric {
    return symmetric_add_outer(
        Symmetric(vec3f(touch.drag), vec3f(0.0)),
        -touch.drag,
        touch.normal,
    );
}

// A drag of all contacts that slide, as the block c (I - n n^T) and the impulse c (I - n n^T) (v - u).
struct Drag {
    plane: Symmetric,
    impulse: vec3f,
}

fn constraint_drag(constraint: ptr<function, Constraint>, velocity: vec3f) -> Drag {
    var drag = Drag(Symmetric(vec3f(0.0), vec3f(0.0)), vec3f(0.0));
    for (var k = 0u; k < (*constraint).count; k += 1u) {
        let touch = (*constraint).touches[k];
        if touch.drag > 0.0 {
            let plane = touch_drag(touch);
            drag.plane.on += plane.on;
            drag.plane.off += plane.off;
            drag.impulse += symmetric_apply(plane, velocity - touch.surface);
        }
    }
    return drag;
}
