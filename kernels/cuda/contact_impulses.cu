// NUMERICS section 8, `contact_impulses`: first how many partners each particle has, then what they do.

extern "C" __global__ void contact_impulses_count(const __grid_constant__ Solver s) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    Motion motion = present_motion(s);
    uint count = 0;
    bool joined = (s.contact & CONTACT_PENALTY) != 0;
    partners_visit(s, motion, i, xyz(motion.x[i]), joined, [&](uint, const Pair&) { count++; });
    s.crowd[i] = count;
    if (count > 0) atomicAdd(&s.status->contacts, (ulong)count);
}

extern "C" __global__ void contact_impulses(const __grid_constant__ Solver s, real recovery, ulong step) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    Motion motion = present_motion(s);
    real4 own = motion.x[i];
    real4 rate = motion.v[i];
    Moved moved = {xyz(own), xyz(rate)};
    uint crowd = s.crowd[i];
    if (crowd > 0 && s.status->non_finite_step > step) impulses_apply(s, motion, i, own.w, crowd, s.crowd, recovery, moved);
    s.position[1 - s.present][i] = with_w(moved.position, own.w);
    s.velocity[1 - s.present][i] = with_w(moved.velocity, rate.w);
}

// Sets the count of contacts back, and those of the meetings of a frame; if wanted, that of the pairs that are looked at, and of builds.
extern "C" __global__ void counts_clear(const __grid_constant__ Solver s, uint with_rebuilds) {
    if (blockIdx.x + threadIdx.x > 0) return;
    s.status->contacts = 0;
    if (with_rebuilds) s.status->rebuilds = 0;
    s.status->meetings[0] = s.status->meetings[1] = 0;
    for (uint k = 0; k < 3; k++) s.status->searched[k] = s.status->taken[k] = 0;
}
