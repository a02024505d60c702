// NUMERICS section 3, `control_forces`: forces on single particles, given while a simulation runs; each particle at most once.

struct ControlForce {
    uint particle;
    // Whether the anchor is where the particle is when the forces are given.
    uint is_here;
    // Constant force [N].
    real force[3];
    // Place of the anchor without its offset [m].
    real anchor[3];
    real stiffness;
    real damping;
    // Longest distance from the anchor that counts [m].
    real reach;
    // Velocity before the last kick [m/s].
    real before[3];
};

// Anchors of springs that begin where their particles are.
extern "C" __global__ void control_forces_anchors(const __grid_constant__ Solver s, ControlForce* forces, uint count) {
    uint k = blockIdx.x * blockDim.x + threadIdx.x;
    if (k >= count || !forces[k].is_here) return;
    real4 x = s.position[s.present][forces[k].particle];
    forces[k].anchor[0] = x.x;
    forces[k].anchor[1] = x.y;
    forces[k].anchor[2] = x.z;
}

// The kick at the start of a substep of length h, with anchors moved by an offset.
extern "C" __global__ void control_forces(const __grid_constant__ Solver s, ControlForce* forces, uint count, real h,
                                          real offset_x, real offset_y, real offset_z, ulong step) {
    uint k = blockIdx.x * blockDim.x + threadIdx.x;
    if (k >= count || s.status->non_finite_step < step) return;
    ControlForce control = forces[k];
    real4 x = s.position[s.present][control.particle];
    real4 v = s.velocity[s.present][control.particle];
    forces[k].before[0] = v.x;
    forces[k].before[1] = v.y;
    forces[k].before[2] = v.z;
    if (!(x.w > 0)) return;
    real d[3] = {
        (control.anchor[0] + offset_x) - x.x,
        (control.anchor[1] + offset_y) - x.y,
        (control.anchor[2] + offset_z) - x.z,
    };
    real distance = root(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (distance > control.reach) {
        real share = control.reach / distance;
        for (int axis = 0; axis < 3; axis++) d[axis] = d[axis] * share;
    }
    real inertia = (v.w + h * control.damping) + (h * h) * control.stiffness;
    real factor = h / inertia;
    real velocity[3] = {v.x, v.y, v.z};
    for (int axis = 0; axis < 3; axis++) {
        real pull = control.stiffness * (d[axis] - h * velocity[axis]) - control.damping * velocity[axis];
        velocity[axis] = velocity[axis] + factor * (control.force[axis] + pull);
    }
    s.velocity[s.present][control.particle] = {velocity[0], velocity[1], velocity[2], v.w};
}

// What the forces add to the system of an implicit substep of length h: beyond its reach a spring is less stiff, so that its force stays what it is there.
extern "C" __global__ void control_forces_assemble(const __grid_constant__ Solver s, const __grid_constant__ Linear l, const ControlForce* forces, uint count,
                                                   real h, real offset_x, real offset_y, real offset_z, uint is_iterate) {
    uint k = blockIdx.x * blockDim.x + threadIdx.x;
    if (k >= count) return;
    ControlForce control = forces[k];
    uint i = control.particle;
    real4 x = s.position[s.present][i];
    real4 v = s.velocity[s.present][i];
    if (!(x.w > 0)) return;
    real d[3] = {
        (control.anchor[0] + offset_x) - x.x,
        (control.anchor[1] + offset_y) - x.y,
        (control.anchor[2] + offset_z) - x.z,
    };
    real distance = root(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    real stiffness = distance > control.reach ? control.stiffness * (control.reach / distance) : control.stiffness;
    real ahead = is_iterate ? (real)0 : h;
    real velocity[3] = {v.x, v.y, v.z};
    real impulse[3];
    for (int axis = 0; axis < 3; axis++) {
        real pull = stiffness * (d[axis] - ahead * velocity[axis]) - control.damping * velocity[axis];
        impulse[axis] = h * (control.force[axis] + pull);
    }
    real term = h * control.damping + (h * h) * stiffness;
    vec3 on = {term, term, term};
    l.base[0][i] = with_w(xyz(l.base[0][i]) + on, 0);
    l.diagonal[0][i] = with_w(xyz(l.diagonal[0][i]) + on, 0);
    vec3 right = xyz(l.vectors[RIGHT_SIDE][i]);
    l.vectors[RIGHT_SIDE][i] = {right.x + impulse[0], right.y + impulse[1], right.z + impulse[2], 0};
}

// Takes the last kick back.
extern "C" __global__ void control_forces_restore(const __grid_constant__ Solver s, const ControlForce* forces, uint count) {
    uint k = blockIdx.x * blockDim.x + threadIdx.x;
    if (k >= count) return;
    ControlForce control = forces[k];
    real4 v = s.velocity[s.present][control.particle];
    s.velocity[s.present][control.particle] = {control.before[0], control.before[1], control.before[2], v.w};
}
