// The composite stage for a regular patch of many tiles, as `explicit_substep.cu` does it, where nothing but fields, springs and
// colliders acts: a whole frame in one launch. Each block has a run of tiles, which go down through the patch strip by strip. As
// each thread has two particles (`patch/pairs.cuh`) there are fewer springs, and less to load, at the edges of tiles.

// As many as leave a thread the registers that it needs: what it has to put aside goes through the second level of the caches.
#define BLOCKS_PER_SM 5

extern __shared__ __align__(16) unsigned char frame_memory[];

extern "C" __global__ void __launch_bounds__(PAIR_THREADS, BLOCKS_PER_SM) explicit_frame(const __grid_constant__ Solver s, uint substeps) {
    __shared__ NearFrame near_frame;
    real4* x = (real4*)frame_memory;
    real4* v = x + TILE_ENTRIES;
    real* forces = (real*)(v + TILE_ENTRIES);
    real offset = s.offsets[0];
    Motion motion = present_motion(s);
    real4* next_x = s.position[1 - s.present];
    real4* next_v = s.velocity[1 - s.present];
    if (*(volatile ulong*)&s.status->non_finite_step < s.substeps[0].step) {
        state_carry(s, 0, substeps);
        publish(s, s.epoch + substeps);
        return;
    }
    uint lane = threadIdx.x % 32, warp = threadIdx.x / 32;
    uint at = (warp * PAIR + HALO) * TILE_STRIDE + lane + HALO;
    PairOuter outer = PairOuter::of_thread();
    AroundLoad loads[AroundLoad::TURNS];
    for (uint turn = 0; turn < AroundLoad::TURNS; turn++) loads[turn] = AroundLoad::of_thread(turn);
    StripRun tiles = StripRun::of(s, blockIdx.x);
    near_frame.start(s, substeps, threadIdx.x, PAIR_THREADS);
    // Of the thread in its slot.
    int place = slot_first((int)warp) + (int)lane;
    for (uint number = 0; number < substeps; number++) {
        copies_wait();
        if (number > 0) {
            wait_for_dependencies(s, s.epoch + number);
        } else {
            __syncthreads();
        }
        StripTile tile = StripTile::of(s, tiles.first);
        strip_tile_start<false>(s, motion, tile, true, loads, x, v);
        const SubstepData& substep = near_frame.of(number);
        const Collider* colliders = near_frame.colliders_of(s, number);
        near_frame.follow<true>(s, number, substeps, threadIdx.x, PAIR_THREADS);
        bool is_first = true;
        for (uint run = tiles.first; run < tiles.end; run++) {
            copies_wait();
            __syncthreads();
            StencilPair pair;
#pragma unroll
            for (uint k = 0; k < PAIR; k++) {
                pair.x[k] = x[at + k * TILE_STRIDE];
                pair.v[k] = v[at + k * TILE_STRIDE];
            }
            int place_first = slot_first((int)warp) + (int)lane;
            strip_springs(s, pair, x, v, at, outer, forces, place, place_first, is_first);
            int above = slot_above(place);
            __syncthreads();
            uint row = tile.row + warp * PAIR, column = tile.column + lane;
            bool inside = stencil_is_inside(s, tile.row, tile.column);
            // Nobody reads this tile any more.
            tile.next(s);
            is_first = tile.row == 0;
            if (run + 1 < tiles.end) strip_tile_start<false>(s, motion, tile, is_first, loads, x, v);
#pragma unroll
            for (uint k = 0; k < PAIR; k++) {
                if (!inside && !(row + k < s.rows && column < s.columns)) continue;
                uint i = (row + k) * s.columns + column;
                Moved moved = strip_move(s, substep, colliders, pair, k, i, row + k, column, inside, forces, place, above, offset);
                particle_store(s, next_x, next_v, substep, i, moved, pair.x[k].w, pair.v[k].w);
            }
            place = above;
        }
        publish(s, s.epoch + number + 1);
        real4* last_x = next_x;
        real4* last_v = next_v;
        next_x = (real4*)motion.x;
        next_v = (real4*)motion.v;
        motion = {last_x, last_v};
    }
}
