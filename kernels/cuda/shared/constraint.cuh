// NUMERICS section 5: what colliders demand of velocities.

#define DIRECTION_MIN ((real)1e-3)
#define SLIP_MIN ((real)1e-4)
#define DRAG_ERROR ((real)0.1)
#define SLIP_ERROR ((real)3e-4)

// Directions that are constrained, orthonormal, and the velocity in them.
struct Span {
    vec3 directions[3];
    uint count;
    vec3 target;

    // Constrains the velocity along a direction as far as it is free.
    __device__ void add(const vec3& direction, real speed) {
        if (count == 3) return;
        vec3 rest = direction;
        for (uint k = 0; k < count; k++) rest = rest - dot(directions[k], direction) * directions[k];
        real length = root(dot(rest, rest));
        if (length < DIRECTION_MIN) return;
        vec3 unit = {rest.x / length, rest.y / length, rest.z / length};
        real missing = (speed - dot(direction, target)) / length;
        target = target + missing * unit;
        directions[count++] = unit;
    }

    // Constrains what a contact constrains.
    __device__ void add_touch(const Touch& touch) {
        add(touch.normal, touch.speed);
        if (touch.sticks != 0) {
            real extra = touch.speed - dot(touch.surface, touch.normal);
            vec3 u = touch.surface, n = touch.normal;
            add(make_vec3(1, 0, 0), u.x + extra * n.x);
            add(make_vec3(0, 1, 0), u.y + extra * n.y);
            add(make_vec3(0, 0, 1), u.z + extra * n.z);
        }
    }
};

// Filter and target of a particle from its contacts.
__device__ __noinline__ void constraint_update(const Linear& l, uint i, const Touch* touches, uint count) {
    Span span;
    span.count = 0;
    span.target = make_vec3(0, 0, 0);
    for (uint k = 0; k < count; k++) span.add_touch(touches[k]);
    vec3 on = {1, 1, 1}, off = {0, 0, 0};
    if (span.count == 3) {
        on = make_vec3(0, 0, 0);
    } else {
        for (uint k = 0; k < span.count; k++) {
            vec3 d = span.directions[k];
            on = on - make_vec3(d.x * d.x, d.y * d.y, d.z * d.z);
            off = off - make_vec3(d.x * d.y, d.x * d.z, d.y * d.z);
        }
    }
    l.filter[0][i] = with_w(on, 0);
    l.filter[1][i] = with_w(off, 0);
    l.target[i] = with_w(span.target, 0);
    l.touch_counts[i] = count;
}

// c P, for the drag c of a contact that slides and P the projector on its plane.
__device__ __forceinline__ Symmetric drag_block(const Touch& touch) {
    real drag = touch.drag;
    vec3 n = touch.normal;
    return {
        {drag * ((real)1 - n.x * n.x), drag * ((real)1 - n.y * n.y), drag * ((real)1 - n.z * n.z)},
        {-(drag * (n.x * n.y)), -(drag * (n.x * n.z)), -(drag * (n.y * n.z))},
    };
}

// Adds c P to B and D and -c P (v - u) to b, for the drag c of each contact times `sign` and P the projector on
// its plane.
__device__ void drag_add(const Linear& l, uint i, const Touch* touches, uint count, real sign, const vec3& velocity) {
    for (uint k = 0; k < count; k++) {
        const Touch& touch = touches[k];
        if (!(touch.drag > 0)) continue;
        Symmetric plane = drag_block(touch);
        vec3 on = sign * plane.on, off = sign * plane.off;
        l.base[0][i] = with_w(xyz(l.base[0][i]) + on, 0);
        l.base[1][i] = with_w(xyz(l.base[1][i]) + off, 0);
        l.diagonal[0][i] = with_w(xyz(l.diagonal[0][i]) + on, 0);
        l.diagonal[1][i] = with_w(xyz(l.diagonal[1][i]) + off, 0);
        vec3 slip = symmetric_apply(on, off, velocity - touch.surface);
        l.vectors[RIGHT_SIDE][i] = with_w(xyz(l.vectors[RIGHT_SIDE][i]) - slip, 0);
    }
}
