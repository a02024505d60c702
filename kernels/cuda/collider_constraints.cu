// NUMERICS section 5, `collider_constraints`.

extern "C" __global__ void collider_constraints(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint collider_first) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    real4 own = s.position[s.present][i], rate = s.velocity[s.present][i];
    if (!(own.w > 0)) {
        l.touch_counts[i] = 0;
        return;
    }
    vec3 x = xyz(own), v = xyz(rate);
    real h = l.length;
    vec3 predicted = {
        v.x + h * (s.acceleration[0] - s.drag_rate[0] * v.x),
        v.y + h * (s.acceleration[1] - s.drag_rate[1] * v.y),
        v.z + h * (s.acceleration[2] - s.drag_rate[2] * v.z),
    };
    real offset = s.offsets[i];
    Touch* touches = l.constraints[i].touches;
    uint count = 0;
    for (uint k = 0; k < s.collider_count; k++) {
        const Collider& c = s.colliders[collider_first + k];
        Surface at = surface_of(c, x - collider_translation(c));
        real depth = offset - at.distance;
        vec3 n = at.normal;
        if (!(depth > h * dot(n, predicted)) || count == TOUCHES_MAX) continue;
        vec3 surface = surface_velocity(c, at, x);
        real surface_speed = dot(surface, n);
        real approach = dot(v, n) - surface_speed;
        real speed = minimum(depth / h, surface_speed);
        if (approach < 0 && c.restitution > 0) speed = maximum(speed, surface_speed - c.restitution * approach);
        vec3 relative = predicted - surface;
        real across = dot(relative, n);
        vec3 along = relative - across * n;
        real push = speed - (across + surface_speed);
        real slip = root(dot(along, along)), grip = c.friction * push;
        bool sticks = slip <= grip;
        real drag = sticks ? (real)0 : maximum(rate.w * grip / maximum(slip - grip, SLIP_MIN), (real)0);
        touches[count++] = {n, speed, surface, c.friction, drag, sticks ? (real)1 : (real)0, (real)k};
    }
    constraint_update(l, i, touches, count);
    if (count > 0) atomicAdd(&l.outcome->constrained, 1u);
}
