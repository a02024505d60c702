// Holds or releases particles, and moves them.

struct Pin {
    uint particle;
    // Bits: held, position given, velocity given.
    uint flags;
    real position[3];
    real velocity[3];
};

extern "C" __global__ void pins_write(const __grid_constant__ Solver s, const Pin* pins, uint count) {
    // In order, as a particle may come twice.
    if (blockIdx.x * blockDim.x + threadIdx.x > 0) return;
    for (uint k = 0; k < count; k++) {
        Pin pin = pins[k];
        real4 x = s.position[s.present][pin.particle];
        real4 v = s.velocity[s.present][pin.particle];
        x.w = (pin.flags & 1u) ? (real)0 : (real)1 / v.w;
        if (pin.flags & 2u) x = {pin.position[0], pin.position[1], pin.position[2], x.w};
        if (pin.flags & 4u) v = {pin.velocity[0], pin.velocity[1], pin.velocity[2], v.w};
        s.position[s.present][pin.particle] = x;
        s.velocity[s.present][pin.particle] = v;
    }
}
