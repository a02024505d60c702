// NUMERICS section 8: building the candidate list with all blocks of a cooperative launch.

// The list is to hold from use `tick` on, for the present positions. Ends with all blocks having read
// what they need; the row of particle i is written by the thread that `first` and `step` give it to.
__device__ __forceinline__ void list_build(const Solver& s, ulong* barrier, Motion motion, uint tick, uint first, uint end, uint step) {
    uint thread = blockIdx.x * blockDim.x + threadIdx.x;
    uint threads = gridDim.x * blockDim.x;
    uint cells = s.cells[0] * s.cells[1] * s.cells[2];
    uint built = s.status->built;
    uint elapsed = tick - s.status->built_tick;
    vec3 drift = {s.drift[0], s.drift[1], s.drift[2]};
    vec3 drift_before = {(real)s.status->drift[0], (real)s.status->drift[1], (real)s.status->drift[2]};
    for (uint i = thread; i < s.count; i += threads) {
        real4 at = motion.x[i];
        // The mean motion since the list was last built, as a velocity also has all that oscillates.
        vec3 q = s.time_step * xyz(motion.v[i]);
        if (built != 0) {
            real4 before = s.reference[i];
            vec3 foreseen = motion_unpack(s, before.w) + drift_before;
            vec3 mean = ((real)1 / (real)max(elapsed, 1u)) * (xyz(at) - xyz(before));
            q = elapsed >= 4 ? mean : elapsed >= 2 ? (real)0.5 * (mean + foreseen) : foreseen;
        }
        q = q - drift;
        uint packed = motion_byte(s, q.x) | motion_byte(s, q.y) << 8 | motion_byte(s, q.z) << 16;
        s.reference[i] = {at.x, at.y, at.z, (real)packed};
        uint cell = cell_index(s, cell_coordinate(s, at.x), cell_coordinate(s, at.y), cell_coordinate(s, at.z));
        s.cell_of[i] = cell;
        s.cell_rank[i] = atomicAdd(&s.cell_counts[cell], 1u);
    }
    if (thread == 0) s.status->candidates = 0;
    grid_barrier(barrier);
    // Exclusive prefix sums: each block one segment, the sums of the segments before it first.
    __shared__ uint sums[32];
    __shared__ uint carry;
    uint segment = (cells + gridDim.x - 1) / gridDim.x;
    uint from = min(blockIdx.x * segment, cells);
    uint to = min(from + segment, cells);
    uint lane = threadIdx.x & 31, warp = threadIdx.x >> 5;
    uint own = 0;
    for (uint cell = from + threadIdx.x; cell < to; cell += blockDim.x) own += s.cell_counts[cell];
    for (uint width = 16; width > 0; width /= 2) own += __shfl_down_sync(0xffffffffu, own, width);
    if (lane == 0) sums[warp] = own;
    __syncthreads();
    if (threadIdx.x == 0) {
        uint total = 0;
        for (uint w = 0; w < blockDim.x / 32; w++) total += sums[w];
        s.cell_sums[blockIdx.x] = total;
    }
    grid_barrier(barrier);
    uint before = 0;
    for (uint block = threadIdx.x; block < blockIdx.x; block += blockDim.x) before += s.cell_sums[block];
    for (uint width = 16; width > 0; width /= 2) before += __shfl_down_sync(0xffffffffu, before, width);
    if (lane == 0) sums[warp] = before;
    __syncthreads();
    if (threadIdx.x == 0) {
        uint total = 0;
        for (uint w = 0; w < blockDim.x / 32; w++) total += sums[w];
        carry = total;
    }
    __syncthreads();
    for (uint start = from; start < to; start += blockDim.x) {
        uint cell = start + threadIdx.x;
        uint count = cell < to ? s.cell_counts[cell] : 0;
        if (cell < to) s.cell_counts[cell] = 0;
        uint sum = count;
        for (uint width = 1; width < 32; width *= 2) {
            uint other = __shfl_up_sync(0xffffffffu, sum, width);
            if (lane >= width) sum += other;
        }
        if (lane == 31) sums[warp] = sum;
        __syncthreads();
        uint offset = carry;
        for (uint w = 0; w < warp; w++) offset += sums[w];
        if (cell < to) s.cell_starts[cell] = offset + sum - count;
        __syncthreads();
        if (threadIdx.x == blockDim.x - 1) carry = offset + sum;
        __syncthreads();
    }
    if (thread == 0) s.cell_starts[cells] = s.count;
    grid_barrier(barrier);
    for (uint i = thread; i < s.count; i += threads) {
        uint place = s.cell_starts[s.cell_of[i]] + s.cell_rank[i];
        s.sorted[place] = s.reference[i];
        s.sorted_index[place] = i;
    }
    grid_barrier(barrier);
    if (thread == 0) {
        for (uint axis = 0; axis < 3; axis++) s.status->drift[axis] = s.drift[axis];
        s.status->horizon = s.list_horizon;
        s.status->built_tick = tick;
        s.status->built = 1;
        s.status->rebuilds++;
    }
    uint entries = 0;
    uint longest = 0;
    for (uint i = first; i < end; i += step) {
        uint found = list_row(s, i);
        s.candidate_counts[i] = min(found, s.candidate_capacity);
        entries += found;
        longest = max(longest, found);
    }
    if (longest > s.candidate_capacity) atomicMax(&s.status->overflow, longest);
    for (uint width = 16; width > 0; width /= 2) entries += __shfl_down_sync(0xffffffffu, entries, width);
    if (lane == 0 && entries > 0) atomicAdd(&s.status->candidates, (ulong)entries);
    // Built tick and drift are read by all.
    grid_barrier(barrier);
}
