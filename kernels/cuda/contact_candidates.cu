// NUMERICS section 8, `contact_candidates`: builds the list if some particle finds that it does not hold.
// A cooperative launch.

extern "C" __global__ void __launch_bounds__(256) contact_candidates(const __grid_constant__ Solver s, uint tick) {
    Motion motion = present_motion(s);
    uint first = blockIdx.x * s.chunk + threadIdx.x;
    uint end = min((blockIdx.x + 1) * s.chunk, s.count);
    bool holds = s.status->built != 0;
    ListState list = list_state(s);
    for (uint i = first; holds && i < end; i += blockDim.x) {
        holds = list_holds(s, list, i, xyz(motion.x[i]), tick);
    }
    if (!holds) s.status->stale[tick & 3] = tick;
    grid_barrier(&s.status->barrier[1]);
    if (*(volatile uint*)&s.status->stale[tick & 3] != tick) return;
    list_build(s, &s.status->barrier[1], motion, tick, first, end, blockDim.x);
}
