// NUMERICS section 8, `contact_candidates`: the pairs in contact at the present positions. Builds the list of groups if
// some group finds that it has left its region. A cooperative launch.

extern "C" __global__ void __launch_bounds__(256) contact_candidates(const __grid_constant__ Solver s, uint tick) {
    Motion motion = present_motion(s);
    ulong* barrier = &s.status->barrier[0];
    bool holds = groups_store(s, 0, motion.x);
    if (!holds || s.status->built == 0) s.status->stale[tick & 3] = tick;
    grid_barrier(barrier);
    if (*(volatile uint*)&s.status->stale[tick & 3] == tick) list_build(s, motion, 0, tick, [&] { grid_barrier(barrier); });
    __shared__ real4 stages[256];
    contacts_find(s, 0, stages + threadIdx.x / 32 * GROUP);
}
