// NUMERICS section 5: what constraints, and the friction of contacts that slide, did to the cloth. The image is A y,
// unless the system is that of an iterate, whose y is zero.
//!include model status call motion vectors symmetric constraint constraint_change feedback

// The part of an impulse that is the contact's own, which added the directions from number `first` up to `end`.
fn share_of(touch: Touch, span: ptr<function, Span>, first: u32, end: u32, impulse: vec3f) -> vec3f {
    var share = vec3f(0.0);
    if touch.sticks != 0u {
        for (var k = first; k < end; k += 1u) {
            let direction = (*span).directions[k];
            share = add_scaled(share, dot_product(impulse, direction), direction);
        }
    } else if end > first {
        let direction = (*span).directions[first];
        let push = dot_product(impulse, direction) / dot_product(touch.normal, direction);
        let across = dot_product(impulse, touch.normal);
        share = max(min(push, across + across), 0.0) * touch.normal;
    }
    return share;
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() || constraint_count(particle) == 0u {
        return;
    }
    var image = vec3f(0.0);
    if !call_has(CALL_ITERATE) {
        image = vector_get(VECTOR_IMAGE, particle);
    }
    var rest = image - vector_get(VECTOR_RIGHT_SIDE, particle);
    var constraint = constraints[particle];
    // Where the directions of each contact end.
    var ends: array<u32, TOUCHES_MAX>;
    var span: Span;
    if constraint.count > 1u {
        for (var k = 0u; k < constraint.count; k += 1u) {
            span_add_touch(&span, constraint.touches[k]);
            ends[k] = span.count;
        }
    }
    let velocity = velocity_in[particle].xyz;
    let position = position_in[particle].xyz;
    for (var left = constraint.count; left > 0u; left -= 1u) {
        let touch = constraint.touches[left - 1u];
        var impulse = rest;
        if left > 1u {
            impulse = share_of(touch, &span, ends[left - 2u], ends[left - 1u], rest);
            rest -= impulse;
        }
        if touch.drag > 0.0 {
            impulse -= symmetric_apply(touch_drag(touch), velocity - touch.surface);
        }
        impulse_add(particle, touch.collider, 1.0, impulse, position);
    }
}
