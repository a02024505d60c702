// NUMERICS section 5, `constraint_impulses`, given A y as the image unless the system is that of an iterate, whose y is
// zero.

// The part of an impulse that is the contact's own, which added the directions from number `first` up to `end`.
__device__ __forceinline__ vec3 share_of(const Touch& touch, const Span& span, uint first, uint end, const vec3& impulse) {
    vec3 share = {0, 0, 0};
    if (touch.sticks != 0) {
        for (uint k = first; k < end; k++) share = share + dot(impulse, span.directions[k]) * span.directions[k];
    } else if (end > first) {
        real push = dot(impulse, span.directions[first]) / dot(touch.normal, span.directions[first]);
        real across = dot(impulse, touch.normal);
        share = maximum(minimum(push, across + across), (real)0) * touch.normal;
    }
    return share;
}

extern "C" __global__ void constraint_impulses(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint is_iterate) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count || l.touch_counts[i] == 0) return;
    uint count = l.touch_counts[i];
    const Touch* touches = l.constraints[i].touches;
    vec3 image = {0, 0, 0};
    if (!is_iterate) image = xyz(l.vectors[IMAGE][i]);
    vec3 rest = image - xyz(l.vectors[RIGHT_SIDE][i]);
    // Where the directions of each contact end.
    uint ends[TOUCHES_MAX];
    Span span;
    span.count = 0;
    span.target = make_vec3(0, 0, 0);
    if (count > 1) {
        for (uint k = 0; k < count; k++) {
            span.add_touch(touches[k]);
            ends[k] = span.count;
        }
    }
    vec3 velocity = xyz(s.velocity[s.present][i]), position = xyz(s.position[s.present][i]);
    for (uint left = count; left > 0; left--) {
        const Touch& touch = touches[left - 1];
        vec3 impulse = rest;
        if (left > 1) {
            impulse = share_of(touch, span, ends[left - 2], ends[left - 1], rest);
            rest = rest - impulse;
        }
        if (touch.drag > 0) {
            Symmetric plane = drag_block(touch);
            impulse = impulse - symmetric_apply(plane.on, plane.off, velocity - touch.surface);
        }
        impulse_sum(s, (uint)touch.collider, i, impulse.x, impulse.y, impulse.z, position);
    }
}
