// NUMERICS section 8: building the list of groups of a large patch, with all blocks of a cooperative launch. Each block compares its
// run of tiles with those of all blocks, then its tiles with those of runs that come near, and then the groups of tiles that do.

// Tiles of a block that are compared at once: numbers of four bits.
#define LIST_TILES 16
// Blocks of a launch, at most.
#define LIST_RUNS 1024

__device__ __forceinline__ uint tile_number(const Solver& s, const StripTile& tile) {
    return tile.row / TILE_ROWS * tiles_across(s) + tile.column / TILE_COLUMNS;
}

__device__ __forceinline__ Box boxes_join(const Box& a, const Box& b) {
    return {
        {minimum(a.low.x, b.low.x), minimum(a.low.y, b.low.y), minimum(a.low.z, b.low.z)},
        {maximum(a.high.x, b.high.x), maximum(a.high.y, b.high.y), maximum(a.high.z, b.high.z)},
    };
}

// The directions of a tile: those of its columns and rows where it has them, at right angles.
__device__ __forceinline__ void tile_directions(const Solver& s, const real4* x, uint tile, vec3& columns, vec3& rows) {
    uint left = tile % tiles_across(s) * TILE_COLUMNS, right = min(left + TILE_COLUMNS, s.columns) - 1;
    uint top = tile / tiles_across(s) * TILE_ROWS, bottom = min(top + TILE_ROWS, s.rows) - 1;
    left = min(left, right - 1);
    top = min(top, bottom - 1);
    uint column = (left + right) / 2, row = (top + bottom) / 2;
    columns = xyz(x[row * s.columns + right]) - xyz(x[row * s.columns + left]);
    rows = xyz(x[bottom * s.columns + column]) - xyz(x[top * s.columns + column]);
    directions_part(columns, rows);
}

// What is asked of the edges of a tile.
struct FlatBounds {
    real along;
    real across;
    real off;

    // So that they are flat in the mean of the directions of the tiles, four at most, at each corner. By four lanes, one for each.
    __device__ __forceinline__ static FlatBounds of(const Solver& s, uint tile, uint corner) {
        vec3 columns = {0, 0, 0}, rows = {0, 0, 0};
        for (uint k = 0; k < 4; k++) {
            uint other = tile_around(s, tile, (corner / 2 + k / 2) * 3 + corner % 2 + k % 2);
            if (other == NONE) continue;
            columns = columns + xyz(s.tile_flat[TileFlat::WORDS * other]);
            rows = rows + xyz(s.tile_flat[TileFlat::WORDS * other + 1]);
        }
        directions_part(columns, rows);
        vec3 u = xyz(s.tile_flat[TileFlat::WORDS * tile]), v = xyz(s.tile_flat[TileFlat::WORDS * tile + 1]), n = cross(u, v);
        // Of what an edge gets on along, across and off, how much at most counts for or against it.
        real d = s.contact_distance, along = FLAT_ALONG * d, across = FLAT_ACROSS * d, most = TileFlat::along_most(s);
        real cosine = minimum(dot(u, columns), dot(v, rows));
        real turn = maximum(absolute(dot(u, rows)), absolute(dot(v, columns))), bend = maximum(absolute(dot(n, columns)), absolute(dot(n, rows)));
        // Room for what is off.
        real room = minimum(FLAT_ALONG_MOST * d * cosine - along - across * turn, across - most * turn - FLAT_ACROSS_LEAST * d);
        bool is_possible = cosine > (real)0.5 && room > 0;
        real off = is_possible ? minimum(room / maximum(bend, (real)1e-6), FLAT_OFF_MOST * d) : 0;
        off = corners_minimum(off);
        FlatBounds bounds = {(along + across * turn + off * bend) / cosine, across - most * turn - off * bend, off};
        if (!is_possible || !(bounds.along > 0)) bounds = {REAL_MAX, 0, 0};
        bounds.along = -corners_minimum(-bounds.along);
        bounds.across = corners_minimum(bounds.across);
        return bounds;
    }
    // The least of four lanes next to each other. All lanes of the warp take part.
    __device__ __forceinline__ static real corners_minimum(real a) {
        a = minimum(a, __shfl_xor_sync(ALL_LANES, a, 1));
        return minimum(a, __shfl_xor_sync(ALL_LANES, a, 2));
    }
};

// What a block needs while it builds the list, in shared memory: of some of its tiles at once.
struct ListMemory {
    uint tiles[LIST_TILES];
    // Regions of groups, and of tiles; at last grown.
    Box regions[LIST_TILES][TILE_GROUPS];
    Box own[LIST_TILES];
    // Blocks whose runs come near.
    unsigned short runs[LIST_RUNS];
    uint run_count;
    // Tiles that come near each of the block, of those that are compared at once.
    uint near[LIST_TILES][PAIR_THREADS];
    uint near_count[LIST_TILES];
    // Entries of their groups; whether one is not of a tile around; and what is asked of edges.
    uint found[LIST_TILES][TILE_GROUPS];
    uint is_far[LIST_TILES];
    FlatBounds bounds[LIST_TILES];

    __device__ __forceinline__ uint group(uint at) const { return tiles[at / TILE_GROUPS] * TILE_GROUPS + at % TILE_GROUPS; }
};

// By all threads: takes `count` tiles of a run, from one on.
__device__ __forceinline__ void tiles_take(const Solver& s, uint first, uint count, ListMemory& near) {
    __syncthreads();
    if (threadIdx.x < count) near.tiles[threadIdx.x] = tile_number(s, StripTile::of(s, first + threadIdx.x));
    __syncthreads();
}

// The regions of the groups of so many tiles, those around all of a tile, and the directions of the tiles.
__device__ __forceinline__ void tile_regions_store(const Solver& s, const Motion& motion, uint count, ListMemory& near) {
    uint lane = threadIdx.x & 31, end = count * TILE_GROUPS;
    // The particles of the next group are on their way while one is worked on.
    real4 entry, rate = {0, 0, 0, 0};
    auto load = [&](uint task) {
        if (task >= end) return;
        entry = GroupsOfPatch{s, motion.x}.position(near.group(task), lane);
        uint i = number_unpack(entry.w);
        if (i != NONE) rate = motion.v[i];
    };
    load(threadIdx.x / 32);
    for (uint task = threadIdx.x / 32; task < end; task += PAIR_WARPS) {
        vec3 x = xyz(entry), v = xyz(rate);
        bool exists = number_unpack(entry.w) != NONE;
        load(task + PAIR_WARPS);
        Box region = region_of(s, exists, x, v);
        box_store(s.group_regions, near.group(task), lane, region);
        if (lane == 0) near.regions[task / TILE_GROUPS][task % TILE_GROUPS] = region;
    }
    __syncthreads();
    if (threadIdx.x < count) {
        uint tile = near.tiles[threadIdx.x];
        Box all = near.regions[threadIdx.x][0];
        for (uint part = 1; part < TILE_GROUPS; part++) all = boxes_join(all, near.regions[threadIdx.x][part]);
        near.own[threadIdx.x] = all;
        s.tile_boxes[2 * tile] = with_w(all.low, 0);
        s.tile_boxes[2 * tile + 1] = with_w(all.high, 0);
        vec3 columns, rows;
        tile_directions(s, motion.x, tile, columns, rows);
        s.tile_flat[TileFlat::WORDS * tile] = with_w(columns, 0);
        s.tile_flat[TileFlat::WORDS * tile + 1] = with_w(rows, 0);
    }
    __syncthreads();
}

// The box around the boxes of so many tiles.
__device__ __forceinline__ Box tiles_box(const ListMemory& near, uint count) {
    Box all = near.own[0];
    for (uint k = 1; k < count; k++) all = boxes_join(all, near.own[k]);
    return all;
}

// Which blocks' runs come near so many tiles.
__device__ __forceinline__ void runs_near_find(const Solver& s, const real4* run_boxes, uint count, ListMemory& near) {
    if (threadIdx.x < count) {
        Box box = box_load(s.tile_boxes, near.tiles[threadIdx.x]);
        near.own[threadIdx.x] = box_grown(box, contact_reach(s, box));
        near.is_far[threadIdx.x] = near.near_count[threadIdx.x] = 0;
    }
    for (uint at = threadIdx.x; at < count * TILE_GROUPS; at += PAIR_THREADS) {
        Box region = box_load(s.group_regions, near.group(at));
        near.regions[at / TILE_GROUPS][at % TILE_GROUPS] = box_grown(region, contact_reach(s, region));
        near.found[at / TILE_GROUPS][at % TILE_GROUPS] = 0;
    }
    if (threadIdx.x == 0) near.run_count = 0;
    __syncthreads();
    Box all = tiles_box(near, count);
#pragma unroll 4
    for (uint run = threadIdx.x; run < gridDim.x; run += PAIR_THREADS) {
        if (boxes_meet(all, box_load(run_boxes, run))) near.runs[atomicAdd(&near.run_count, 1u)] = (unsigned short)run;
    }
    __syncthreads();
}

// The lists of the groups of so many tiles.
__device__ __forceinline__ void tile_rows_build(const Solver& s, uint count, ListMemory& near) {
    uint lane = threadIdx.x % 32, across = tiles_across(s), longest = (StripTile::count(s) + gridDim.x - 1) / gridDim.x, looked = near.run_count * longest;
    for (uint first = 0; first < looked; first += PAIR_THREADS) {
        uint at = first + threadIdx.x;
        if (at < looked) {
            StripRun run = StripRun::of(s, near.runs[at / longest]);
            uint number = run.first + at % longest;
            if (number < run.end) {
                uint other = tile_number(s, StripTile::of(s, number));
                Box theirs = box_load(s.tile_boxes, other);
                for (uint k = 0; k < count; k++) {
                    if (boxes_meet(near.own[k], theirs)) near.near[k][atomicAdd(&near.near_count[k], 1u)] = other;
                }
            }
        }
        __syncthreads();
        // A warp takes a tile of the block, and a lane a group of those that come near it.
        for (uint k = threadIdx.x / 32; k < count; k += PAIR_WARPS) {
            uint tile = near.tiles[k], end = near.near_count[k] * TILE_GROUPS;
            uint found = lane < TILE_GROUPS ? near.found[k][lane] : 0;
            bool is_far = false;
            // That of the next group is on its way while one is looked at.
            uint next = 0;
            Box region;
            auto load = [&](uint task) {
                if (task < end) next = near.near[k][task / TILE_GROUPS] * TILE_GROUPS + task % TILE_GROUPS;
                region = box_load(s.group_regions, next);
            };
            load(lane);
            for (uint task = lane; task < (end + 31) / 32 * 32; task += 32) {
                uint other = next;
                Box present = region;
                load(task + 32);
                bool is_near = false;
#pragma unroll
                for (uint part = 0; part < TILE_GROUPS; part++) {
                    bool meets = task < end && boxes_meet(near.regions[k][part], present);
                    uint all = __ballot_sync(ALL_LANES, meets), place = __shfl_sync(ALL_LANES, found, part) + __popc(all & (1u << lane) - 1);
                    if (meets && place < s.group_capacity) s.group_rows[(tile * TILE_GROUPS + part) * s.group_capacity + place] = other;
                    if (lane == part) found += __popc(all);
                    is_near |= meets;
                }
                uint theirs = other / TILE_GROUPS;
                uint columns = theirs % across - tile % across, rows = theirs / across - tile / across;
                is_far |= is_near && (columns + 1 > 2 || rows + 1 > 2);
            }
            if (__any_sync(ALL_LANES, is_far) && lane == 0) near.is_far[k] = 1;
            // All have seen what is written here.
            __syncwarp();
            if (lane < TILE_GROUPS) near.found[k][lane] = found;
            if (lane == 0) near.near_count[k] = 0;
        }
        __syncthreads();
    }
}

// Books the rows of so many tiles, and what is asked of their edges; what is not alone is searched in the substep. Gives how many
// groups the rows of the thread name.
__device__ __forceinline__ uint tile_rows_book(const Solver& s, uint count, uint substep, uint tick, ListMemory& near) {
    for (uint task = threadIdx.x; task < LIST_TILES * 4; task += PAIR_THREADS) {
        FlatBounds bounds = FlatBounds::of(s, near.tiles[min(task / 4, count - 1)], task % 4);
        if (task % 4 == 0 && task / 4 < count) near.bounds[task / 4] = bounds;
    }
    __syncthreads();
    uint looks = 0;
    for (uint at = threadIdx.x; at < count * TILE_GROUPS; at += PAIR_THREADS) {
        uint total = near.found[at / TILE_GROUPS][at % TILE_GROUPS];
        s.group_counts[near.group(at)] = min(total, s.group_capacity);
        if (total > s.group_capacity) atomicMax(&s.status->group_overflow, total);
        looks += total;
    }
    if (threadIdx.x < count) {
        uint tile = near.tiles[threadIdx.x];
        bool is_far = near.is_far[threadIdx.x] != 0;
        real4* words = s.tile_flat + TileFlat::WORDS * tile;
        FlatBounds bounds = near.bounds[threadIdx.x];
        words[0].w = bounds.along;
        words[1].w = bounds.across;
        words[2] = with_w(cross(xyz(words[0]), xyz(words[1])), is_far ? -bounds.off : bounds.off);
        if (is_far) tile_search(s, tile, substep, tick);
    }
    return looks;
}

// The list is to hold from use `tick` on, for the positions of `motion`. All blocks call `meet` to wait for each other, and end
// with what they need. Tiles that are not alone are put among those that are searched in the substep.
template <typename Meet> __device__ __forceinline__ void tiles_list_build(const Solver& s, const Motion& motion, uint substep, uint tick, ListMemory& near, Meet meet) {
    StripRun run = StripRun::of(s, blockIdx.x);
    // They are behind those of tiles.
    real4* run_boxes = s.tile_boxes + 2 * StripTile::count(s);
    auto count_from = [&](uint first) { return min(run.end - first, LIST_TILES); };
    Box all;
    for (uint first = run.first; first < run.end; first += LIST_TILES) {
        uint count = count_from(first);
        tiles_take(s, first, count, near);
        tile_regions_store(s, motion, count, near);
        Box some = tiles_box(near, count);
        all = first == run.first ? some : boxes_join(all, some);
    }
    box_store(run_boxes, blockIdx.x, threadIdx.x, all);
    if (blockIdx.x + threadIdx.x == 0) s.status->candidates = 0;
    meet();
    uint looks = 0;
    for (uint first = run.first; first < run.end; first += LIST_TILES) {
        uint count = count_from(first);
        tiles_take(s, first, count, near);
        runs_near_find(s, run_boxes, count, near);
        tile_rows_build(s, count, near);
        looks += tile_rows_book(s, count, substep, tick, near);
    }
    list_book(s, looks, LIST_BUILT_WITH_TILES);
    meet();
}
