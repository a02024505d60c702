// NUMERICS section 5, `constraint_release`, given A y as the image.

extern "C" __global__ void constraint_release(const __grid_constant__ Solver s, const __grid_constant__ Linear l) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count || l.touch_counts[i] == 0) return;
    uint count = l.touch_counts[i];
    Touch before[TOUCHES_MAX], touches[TOUCHES_MAX];
    for (uint k = 0; k < count; k++) before[k] = touches[k] = l.constraints[i].touches[k];
    uint count_before = count;
    vec3 velocity = xyz(s.velocity[s.present][i]);
    real mass = s.velocity[s.present][i].w;
    vec3 impulse = xyz(l.vectors[IMAGE][i]) - xyz(l.vectors[RIGHT_SIDE][i]);
    vec3 after = velocity + xyz(l.vectors[SOLUTION][i]);
    vec3 on = xyz(l.diagonal[0][i]), off = xyz(l.diagonal[1][i]);
    bool changed = false, updated = false;
    for (uint at = count; at > 0 && !updated; at--) {
        Touch& touch = touches[at - 1];
        vec3 n = touch.normal;
        real push = dot(impulse, n);
        if (push < 0) {
            for (uint k = at; k < count; k++) touches[k - 1] = touches[k];
            count--;
            updated = true;
            continue;
        }
        real grip = touch.friction * push;
        if (touch.sticks != 0) {
            vec3 tangential = impulse - dot(impulse, n) * n;
            real along = root(dot(tangential, tangential));
            if (along <= grip) continue;
            real divisor = maximum(along, LENGTH_MIN);
            vec3 t = {tangential.x / divisor, tangential.y / divisor, tangential.z / divisor};
            real inertia = dot(t, symmetric_apply(on, off, t));
            touch.sticks = 0;
            touch.drag = grip * inertia / (along - grip);
            updated = true;
            continue;
        }
        vec3 relative = after - touch.surface;
        vec3 tangential = relative - dot(relative, n) * n;
        real slip = maximum(root(dot(tangential, tangential)), SLIP_MIN);
        real drag = grip / slip;
        real error = absolute(drag - touch.drag) * slip;
        if (error > maximum(DRAG_ERROR * grip, mass * SLIP_ERROR)) {
            touch.drag = drag;
            changed = true;
        }
    }
    if (!changed && !updated) return;
    for (uint k = 0; k < count; k++) l.constraints[i].touches[k] = touches[k];
    if (updated) constraint_update(l, i, touches, count);
    drag_add(l, i, before, count_before, (real)-1, velocity);
    drag_add(l, i, touches, count, (real)1, velocity);
    atomicAdd(&l.outcome->changed, 1u);
}
