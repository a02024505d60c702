// The composite stage for a regular patch of few tiles: a whole frame in one launch, in which each block keeps a tile in
// shared memory from substep to substep.
//
// Blocks send each other the particles at the edges of their tiles in words of 16 bytes that are stored and loaded
// whole, and that carry the number of the substep: who waits for a particle has it as soon as it sees the number, and
// nothing else has to be waited for. There are two words for each, used in turn: a block sends those of the next
// substep only when it has seen that all around have read those of the last one, as they have sent what they made of them.

// One for each particle of a tile.
#define THREADS (TILE_COLUMNS * TILE_ROWS)

extern __shared__ __align__(16) unsigned char frame_memory[];

extern "C" __global__ void __launch_bounds__(THREADS, 1) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    __shared__ NearFrame near_frame;
    real4* x = (real4*)frame_memory;
    real4* v = x + TILE_ENTRIES;
    real* forces = (real*)(v + TILE_ENTRIES);
    uint across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
    uint first_column = blockIdx.x % across * TILE_COLUMNS, first_row = blockIdx.x / across * TILE_ROWS;
    bool inside = stencil_is_inside(s, first_row, first_column);
    Motion motion = present_motion(s);
    real4* last_x = s.position[s.present ^ substeps & 1];
    real4* last_v = s.velocity[s.present ^ substeps & 1];
    ulong broken = *(volatile ulong*)&s.status->non_finite_step;
    uint lane = threadIdx.x & 31;
    // The last warp has time to read ahead while others wait for particles around the tile.
    bool reads_ahead = threadIdx.x / 32 == THREADS / 32 - 1;
    if (reads_ahead) near_frame.start(s, substeps, lane, 32);
    rectangle_start<TILE_ENTRIES, TILE_STRIDE, THREADS>(s, motion, first_row - HALO, first_column - HALO, 0, x, v);
    uint tile_column = threadIdx.x % TILE_COLUMNS, tile_row = threadIdx.x / TILE_COLUMNS;
    uint column = first_column + tile_column, row = first_row + tile_row;
    bool exists = column < s.columns && row < s.rows;
    uint i = row * s.columns + column;
    uint at = (tile_row + HALO) * TILE_STRIDE + tile_column + HALO;
    uint mask = stencil_mask(s, row, column);
    bool sends = exists && (tile_column < HALO || tile_column >= TILE_COLUMNS - HALO || tile_row < HALO || tile_row >= TILE_ROWS - HALO);
    // What the thread waits for.
    uint around_row = 0, around_column = 0;
    surrounding_entry(min(threadIdx.x, SURROUNDING - 1), around_row, around_column);
    uint around = around_row * TILE_STRIDE + around_column;
    around_row += first_row - HALO;
    around_column += first_column - HALO;
    bool takes = threadIdx.x < SURROUNDING && around_row < s.rows && around_column < s.columns;
    uint around_i = around_row * s.columns + around_column;
    real offset = s.offsets[0];
    StencilOuter outer = StencilOuter::of_thread();
    copies_wait();
    __syncthreads();
    bool stopped = broken < near_frame.of(0).step;
    if (stopped) {
        if (exists) {
            last_x[i] = x[at];
            last_v[i] = v[at];
        }
        return;
    }
    real inverse_mass = x[at].w, mass = v[at].w;
    for (uint number = 0; number < substeps; number++) {
        const SubstepData& substep = near_frame.of(number);
        vec3 springs[STENCIL_KINDS];
        stencil_springs(s, x, v, tile_row, tile_column, outer, forces, springs);
        __syncthreads();
        vec3 xi = xyz(x[at]), vi = xyz(v[at]);
        vec3 force = field_force(s, mass, vi);
        force = procedural_force(substep, i, xi, vi, mass, force);
        if (inside) {
            force = stencil_sum<true, true>(forces, tile_row, tile_column, 0, springs, force);
        } else {
            force = stencil_sum<false, true>(forces, tile_row, tile_column, mask, springs, force);
        }
        Moved moved = integrate(substep.length, inverse_mass, force, xi, vi);
        if (exists && inverse_mass > 0) near_frame.collide(s, number, i, offset, inverse_mass, xi, moved);
        if (exists && !(is_finite(moved.position) && is_finite(moved.velocity))) atomicMin(&s.status->non_finite_step, substep.step);
        if (number + 1 == substeps) {
            if (exists) {
                last_x[i] = with_w(moved.position, inverse_mass);
                last_v[i] = with_w(moved.velocity, mass);
            }
            break;
        }
        uint tag = (uint)s.epoch + number + 1;
        uint4* packets = s.packets + (size_t)(tag & 1) * 2 * s.count;
        if (sends) {
            packet_send(packets + 2 * i, moved.position, tag);
            packet_send(packets + 2 * i + 1, moved.velocity, tag);
        }
        x[at] = with_w(moved.position, inverse_mass);
        v[at] = with_w(moved.velocity, mass);
        if (reads_ahead) near_frame.follow<false>(s, number, substeps, lane, 32);
        if (takes) {
            vec3 position, velocity;
            packets_wait(packets + 2 * around_i, packets + 2 * around_i + 1, tag, position, velocity);
            x[around] = with_w(position, 0);
            v[around] = with_w(velocity, 0);
        }
        __syncthreads();
    }
}
