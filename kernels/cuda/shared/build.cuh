// NUMERICS section 8: building the list of groups with all blocks of a cooperative launch.
//
// Regions are put into the cells of a hashed grid that they touch, each cell a chain of them. Heads of chains carry
// the use that they were made for, so that none has to be cleared.

// Cells of a region that are put into the grid.
#define COVER_MAX 27
// So few groups are compared each with all.
#define GROUPS_FEW 1024

struct Cover {
    int low[3];
    uint size[3];
    // More than COVER_MAX is too many.
    uint count;
};

__device__ __forceinline__ int cell_coordinate(const Solver& s, real x) {
    real scaled = x * s.cells_per_metre;
    scaled = minimum(maximum(scaled, (real)-1e9), (real)1e9);
    int truncated = (int)scaled;
    return truncated - ((real)truncated > scaled ? 1 : 0);
}

__device__ __forceinline__ uint cell_of(const Solver& s, int x, int y, int z) {
    uint mixed = (uint)x * 0x9e3779b1u ^ (uint)y * 0x85ebca77u ^ (uint)z * 0xc2b2ae3du;
    return (mixed ^ mixed >> 15) & s.cell_mask;
}

// Names a cell among those around it.
__device__ __forceinline__ uint cell_name(int x, int y, int z) {
    return ((uint)x & 1023u) | ((uint)y & 1023u) << 10 | ((uint)z & 1023u) << 20;
}

__device__ __forceinline__ Cover cover_of(const Solver& s, const Box& region) {
    Box box = box_grown(region, contact_reach(s, region));
    Cover cover;
    real low[3] = {box.low.x, box.low.y, box.low.z}, high[3] = {box.high.x, box.high.y, box.high.z};
    cover.count = low[0] <= high[0] ? 1 : 0;
    for (uint axis = 0; axis < 3; axis++) {
        cover.low[axis] = cell_coordinate(s, low[axis]);
        cover.size[axis] = min((uint)(cell_coordinate(s, high[axis]) - cover.low[axis]), COVER_MAX) + 1;
        cover.count *= cover.size[axis];
    }
    return cover;
}

// Cell `number` of a cover.
__device__ __forceinline__ void cover_cell(const Cover& cover, uint number, int* at) {
    uint rest = number / cover.size[0];
    at[0] = cover.low[0] + (int)(number % cover.size[0]);
    at[1] = cover.low[1] + (int)(rest % cover.size[1]);
    at[2] = cover.low[2] + (int)(rest / cover.size[1]);
}

// The region of a group for the time from now on.
__device__ __forceinline__ Box region_of(const Solver& s, bool exists, const vec3& x, const vec3& v) {
    vec3 later = x + s.list_horizon * v;
    Box now = warp_box(exists, x, x);
    Box all = warp_box(
        exists, make_vec3(minimum(later.x, x.x), minimum(later.y, x.y), minimum(later.z, x.z)),
        make_vec3(maximum(later.x, x.x), maximum(later.y, x.y), maximum(later.z, x.z))
    );
    // What moves fast strays far.
    const real share = 0.25;
    vec3 margin = {
        s.list_margin + share * ((now.low.x - all.low.x) + (all.high.x - now.high.x)),
        s.list_margin + share * ((now.low.y - all.low.y) + (all.high.y - now.high.y)),
        s.list_margin + share * ((now.low.z - all.low.z) + (all.high.z - now.high.z)),
    };
    return {all.low - margin, all.high + margin};
}

__device__ __forceinline__ void row_add(const Solver& s, uint group, uint other, uint* found) {
    uint k = atomicAdd(found, 1u);
    if (k < s.group_capacity) s.group_rows[group * s.group_capacity + k] = other;
}

// Books that the list is built, and how many groups the rows of the thread name.
__device__ __forceinline__ void list_book(const Solver& s, ulong looks, uint built) {
    if (looks > 0) atomicAdd(&s.status->candidates, looks * (ulong)(GROUP * GROUP));
    if (blockIdx.x + threadIdx.x == 0) {
        s.status->built = built;
        s.status->rebuilds++;
    }
}

// The list is to hold from use `tick` on, for the positions of `motion`, which are side `side` of those by group. All blocks
// call `meet` to wait for each other, and end with what they need.
template <typename Meet>
__device__ __forceinline__ void list_build(const Solver& s, const Motion& motion, uint side, uint tick, Meet meet) {
    __shared__ uint found[32];
    uint lane = threadIdx.x & 31, warp = threadIdx.x / 32;
    uint first = warp_number();
    uint warps = gridDim.x * blockDim.x / 32;
    bool few = s.group_count <= GROUPS_FEW;
    for (uint group = first; group < s.group_count; group += warps) {
        real4 entry = s.group_positions[side][group * GROUP + lane];
        uint i = number_unpack(entry.w);
        bool exists = i != NONE;
        vec3 v = exists ? xyz(motion.v[i]) : make_vec3(0, 0, 0);
        Box region = region_of(s, exists, xyz(entry), v);
        box_store(s.group_regions, group, lane, region);
        if (few) continue;
        Cover cover = cover_of(s, region);
        if (cover.count > COVER_MAX) {
            if (lane == 0) s.status->large = tick;
        } else if (lane < cover.count) {
            int at[3];
            cover_cell(cover, lane, at);
            uint node = group * COVER_MAX + lane;
            ulong head = (ulong)tick << 32 | (ulong)(node + 1);
            ulong before = atomicExch(&s.cell_heads[cell_of(s, at[0], at[1], at[2])], head);
            uint next = (uint)(before >> 32) == tick ? (uint)before : 0;
            s.cell_nodes[node] = {next, cell_name(at[0], at[1], at[2])};
        }
    }
    if (blockIdx.x + threadIdx.x == 0) s.status->candidates = 0;
    meet();
    bool each = few || *(volatile uint*)&s.status->large == tick;
    ulong looks = 0;
    for (uint group = first; group < s.group_count; group += warps) {
        Box region = box_load(s.group_regions, group);
        Box near = box_grown(region, contact_reach(s, region));
        if (lane == 0) found[warp] = 0;
        __syncwarp();
        Cover cover = few ? Cover{{0, 0, 0}, {0, 0, 0}, 0} : cover_of(s, region);
        if (each) {
            // Where some region has too many cells this takes long: that happens to what flies apart.
#pragma unroll 8
            for (uint other = lane; other < s.group_count; other += 32) {
                if (boxes_meet(near, box_load(s.group_regions, other))) row_add(s, group, other, &found[warp]);
            }
        } else if (lane < cover.count) {
            int at[3];
            cover_cell(cover, lane, at);
            uint name = cell_name(at[0], at[1], at[2]);
            ulong head = s.cell_heads[cell_of(s, at[0], at[1], at[2])];
            uint node = (uint)(head >> 32) == tick ? (uint)head : 0;
            while (node != 0) {
                uint2 entry = s.cell_nodes[node - 1];
                uint other = (node - 1) / COVER_MAX;
                node = entry.x;
                // Chains may be of several cells.
                if (entry.y != name) continue;
                Box theirs = box_load(s.group_regions, other);
                if (!boxes_meet(near, theirs)) continue;
                // Two regions share cells, and are listed in the lowest.
                Cover covered = cover_of(s, theirs);
                bool lowest = true;
                for (uint axis = 0; axis < 3; axis++) lowest &= at[axis] == max(cover.low[axis], covered.low[axis]);
                if (lowest) row_add(s, group, other, &found[warp]);
            }
        }
        __syncwarp();
        uint total = found[warp];
        if (lane == 0) {
            s.group_counts[group] = min(total, s.group_capacity);
            if (total > s.group_capacity) atomicMax(&s.status->group_overflow, total);
            looks += total;
        }
        __syncwarp();
    }
    list_book(s, looks, LIST_BUILT);
    meet();
}
