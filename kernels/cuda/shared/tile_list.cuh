// NUMERICS section 8: building the list of groups of a large patch, with all blocks of a cooperative launch: tiles are compared each
// with all, and then the groups of those that come near each other.

// Tiles of a block that are compared at once.
#define LIST_TILES 16
// Tiles near one that are kept; if there are more all are looked at.
#define LIST_NEAR 64

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
    // Regions of groups, at last grown.
    Box regions[LIST_TILES][TILE_GROUPS];
    // Tiles, grown, and those that come near each.
    Box own[LIST_TILES];
    uint near[LIST_TILES][LIST_NEAR];
    uint near_count[LIST_TILES];
    // Entries of their groups; whether one is not of a tile around; and what is asked of edges.
    uint found[LIST_TILES][TILE_GROUPS];
    uint is_far[LIST_TILES];
    FlatBounds bounds[LIST_TILES];
};

// The regions of the groups of tiles, those around all of a tile, and the directions of the tiles: of `count` from `first` on.
__device__ __forceinline__ void tile_regions_store(const Solver& s, const Motion& motion, uint first, uint count, ListMemory& near) {
    uint lane = threadIdx.x & 31, warps = blockDim.x / 32, end = count * TILE_GROUPS;
    auto group_of = [&](uint task) { return (first + task / TILE_GROUPS * gridDim.x) * TILE_GROUPS + task % TILE_GROUPS; };
    // The particles of the next group are on their way while one is worked on.
    real4 entry, rate = {0, 0, 0, 0};
    auto load = [&](uint task) {
        if (task >= end) return;
        entry = GroupsOfPatch{s, motion.x}.position(group_of(task), lane);
        uint i = number_unpack(entry.w);
        if (i != NONE) rate = motion.v[i];
    };
    load(threadIdx.x / 32);
    for (uint task = threadIdx.x / 32; task < end; task += warps) {
        vec3 x = xyz(entry), v = xyz(rate);
        bool exists = number_unpack(entry.w) != NONE;
        load(task + warps);
        Box region = region_of(s, exists, x, v);
        box_store(s.group_regions, group_of(task), lane, region);
        if (lane == 0) near.regions[task / TILE_GROUPS][task % TILE_GROUPS] = region;
    }
    __syncthreads();
    if (threadIdx.x < count) {
        uint tile = first + threadIdx.x * gridDim.x;
        Box all = near.regions[threadIdx.x][0];
        for (uint part = 1; part < TILE_GROUPS; part++) all = boxes_join(all, near.regions[threadIdx.x][part]);
        s.tile_boxes[2 * tile] = with_w(all.low, 0);
        s.tile_boxes[2 * tile + 1] = with_w(all.high, 0);
        vec3 columns, rows;
        tile_directions(s, motion.x, tile, columns, rows);
        s.tile_flat[TileFlat::WORDS * tile] = with_w(columns, 0);
        s.tile_flat[TileFlat::WORDS * tile + 1] = with_w(rows, 0);
    }
    __syncthreads();
}

// Which tiles come near `count` from `first` on.
__device__ __forceinline__ void tiles_near_find(const Solver& s, uint first, uint count, uint tiles, ListMemory& near) {
    if (threadIdx.x < count) {
        Box box = box_load(s.tile_boxes, first + threadIdx.x * gridDim.x);
        near.own[threadIdx.x] = box_grown(box, contact_reach(s, box));
        near.near_count[threadIdx.x] = near.is_far[threadIdx.x] = 0;
    }
    for (uint at = threadIdx.x; at < count * TILE_GROUPS; at += blockDim.x) {
        uint k = at / TILE_GROUPS, part = at % TILE_GROUPS;
        Box region = box_load(s.group_regions, (first + k * gridDim.x) * TILE_GROUPS + part);
        near.regions[k][part] = box_grown(region, contact_reach(s, region));
        near.found[k][part] = 0;
    }
    __syncthreads();
#pragma unroll 2
    for (uint other = threadIdx.x; other < tiles; other += blockDim.x) {
        Box theirs = box_load(s.tile_boxes, other);
        for (uint k = 0; k < count; k++) {
            if (!boxes_meet(near.own[k], theirs)) continue;
            uint place = atomicAdd(&near.near_count[k], 1u);
            if (place < LIST_NEAR) near.near[k][place] = other;
        }
    }
    __syncthreads();
}

// The lists of the groups of a tile, by a warp; `k` is the number of the tile among those of the block.
__device__ __forceinline__ void tile_rows_build(const Solver& s, uint tile, uint k, uint tiles, ListMemory& near) {
    uint across = tiles_across(s);
    bool each = near.near_count[k] > LIST_NEAR;
    uint looked = (each ? tiles : near.near_count[k]) * TILE_GROUPS;
#pragma unroll 4
    for (uint at = threadIdx.x & 31; at < looked; at += 32) {
        uint theirs = each ? at / TILE_GROUPS : near.near[k][at / TILE_GROUPS], other = theirs * TILE_GROUPS + at % TILE_GROUPS;
        Box region = box_load(s.group_regions, other);
        bool is_near = false;
        for (uint part = 0; part < TILE_GROUPS; part++) {
            if (!boxes_meet(near.regions[k][part], region)) continue;
            row_add(s, tile * TILE_GROUPS + part, other, &near.found[k][part]);
            is_near = true;
        }
        uint columns = theirs % across - tile % across, rows = theirs / across - tile / across;
        if (is_near && (columns + 1 > 2 || rows + 1 > 2)) near.is_far[k] = 1;
    }
}

// The list is to hold from use `tick` on, for the positions of `motion`. All blocks call `meet` to wait for each other, and end
// with what they need. Tiles that are not alone are put among those that are searched in the substep.
template <typename Meet> __device__ __forceinline__ void tiles_list_build(const Solver& s, const Motion& motion, uint substep, uint tick, ListMemory& near, Meet meet) {
    uint tiles = tiles_across(s) * tiles_down(s), stride = LIST_TILES * gridDim.x;
    auto count_from = [&](uint first) { return min((tiles - first + gridDim.x - 1) / gridDim.x, LIST_TILES); };
    for (uint first = blockIdx.x; first < tiles; first += stride) tile_regions_store(s, motion, first, count_from(first), near);
    if (blockIdx.x + threadIdx.x == 0) s.status->candidates = 0;
    meet();
    uint looks = 0;
    for (uint first = blockIdx.x; first < tiles; first += stride) {
        uint count = count_from(first);
        tiles_near_find(s, first, count, tiles, near);
        for (uint k = threadIdx.x / 32; k < count; k += blockDim.x / 32) tile_rows_build(s, first + k * gridDim.x, k, tiles, near);
        for (uint task = threadIdx.x; task < LIST_TILES * 4; task += blockDim.x) {
            uint k = min(task / 4, count - 1);
            FlatBounds bounds = FlatBounds::of(s, first + k * gridDim.x, task % 4);
            if (task % 4 == 0 && task / 4 < count) near.bounds[k] = bounds;
        }
        __syncthreads();
        for (uint task = threadIdx.x; task < count * TILE_GROUPS; task += blockDim.x) {
            uint k = task / TILE_GROUPS, group = (first + k * gridDim.x) * TILE_GROUPS + task % TILE_GROUPS;
            uint total = near.found[k][task % TILE_GROUPS];
            s.group_counts[group] = min(total, s.group_capacity);
            if (total > s.group_capacity) atomicMax(&s.status->group_overflow, total);
            looks += total;
        }
        if (threadIdx.x < count) {
            uint tile = first + threadIdx.x * gridDim.x;
            real4* words = s.tile_flat + TileFlat::WORDS * tile;
            FlatBounds bounds = near.bounds[threadIdx.x];
            words[0].w = bounds.along;
            words[1].w = bounds.across;
            words[2] = with_w(cross(xyz(words[0]), xyz(words[1])), near.is_far[threadIdx.x] == 0 ? bounds.off : -bounds.off);
            if (near.is_far[threadIdx.x] != 0) tile_search(s, tile, substep, tick);
        }
        __syncthreads();
    }
    list_book(s, looks, LIST_BUILT_WITH_TILES);
    meet();
}
