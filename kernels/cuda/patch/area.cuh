// A tile of a small patch and a group around it on all sides, which a block keeps in shared memory, and how its particles are named and
// sent (`packet.cuh`).

#define TILE_PARTICLES (TILE_COLUMNS * TILE_ROWS)
#define GROUP_COLUMNS 8
#define GROUP_ROWS 4
// The tile and a group around it on all sides.
#define AREA_STRIDE (TILE_COLUMNS + 2 * GROUP_COLUMNS)
#define AREA_ENTRIES (AREA_STRIDE * (TILE_ROWS + 2 * GROUP_ROWS))

// Turned around in the number that boxes carry which are those of groups as they are, and not as they were expected.
#define BOX_EXACT 0x80000000u

// By the lanes of a warp together.
__device__ __forceinline__ void box_send(uint4* boxes, uint group, uint lane, const Box& box, uint number) {
    if (lane < 2) packet_send(boxes + 2 * group + lane, lane == 0 ? box.low : box.high, number);
}

// What is sent in one substep.
struct AreaPackets {
    uint4* positions;
    uint4* velocities;
    // Two for each group.
    uint4* boxes;
    // One for each block.
    uint4* votes;
    uint number;
    // Whether boxes have to be those of groups as they are.
    bool is_exact;

    __device__ __forceinline__ static uint size(const Solver& s) { return 2 * s.count + 2 * s.group_count + gridDim.x; }

    __device__ __forceinline__ static AreaPackets of(const Solver& s, uint number) {
        uint4* first = s.packets + (number & 1) * size(s);
        return {first, first + s.count, first + 2 * s.count, first + 2 * s.count + 2 * s.group_count, number, false};
    }

    // Those of the regions of groups, of any substep.
    __device__ __forceinline__ static uint4* regions(const Solver& s) { return s.packets + 2 * size(s); }

    // The box of the group of a warp, to all that have it in their lists.
    __device__ __forceinline__ void group_send(uint group, uint lane, const Box& box) const { box_send(boxes, group, lane, box, is_exact ? number ^ BOX_EXACT : number); }
    __device__ __forceinline__ void box_ask(uint group, Coming& coming) const {
        if (group != NONE) coming.ask(boxes + 2 * group, boxes + 2 * group + 1);
    }
    // One that is as it is may have taken the place of that which was expected, and does as well.
    __device__ __forceinline__ void box_wait(uint group, Coming& coming, Box& box) const {
        coming.wait(boxes + 2 * group, boxes + 2 * group + 1, number ^ BOX_EXACT, box.low, box.high, is_exact ? ~0u : ~BOX_EXACT);
    }
    __device__ __forceinline__ void particle_ask(uint i, Coming& coming) const { coming.ask(positions + i, velocities + i); }
    __device__ __forceinline__ void particle_wait(uint i, Coming& coming, vec3& position, vec3& velocity) const {
        coming.wait(positions + i, velocities + i, number, position, velocity);
    }
    __device__ __forceinline__ void particle_wait(uint i, vec3& position, vec3& velocity) const {
        packets_wait(positions + i, velocities + i, number, position, velocity);
    }
};

// A group of the patch: its first row and column, and its particle of a lane.
struct GroupPlace {
    uint row;
    uint column;

    __device__ __forceinline__ static GroupPlace of(const Solver& s, uint group) {
        uint across = (s.columns + TILE_COLUMNS - 1) / TILE_COLUMNS;
        uint tile = group / TILE_GROUPS, part = group % TILE_GROUPS;
        return {tile / across * TILE_ROWS + part / 4 * GROUP_ROWS, tile % across * TILE_COLUMNS + part % 4 * GROUP_COLUMNS};
    }
    // In one word, as nobody wants to divide once more.
    __device__ __forceinline__ uint pack() const { return row << 16 | column; }
    __device__ __forceinline__ static GroupPlace unpack(uint packed) { return {packed >> 16, packed & 0xffffu}; }
    __device__ __forceinline__ bool has(const Solver& s, uint lane) const {
        return row + lane / GROUP_COLUMNS < s.rows && column + lane % GROUP_COLUMNS < s.columns;
    }
    __device__ __forceinline__ uint particle(const Solver& s, uint lane) const {
        return (row + lane / GROUP_COLUMNS) * s.columns + column + lane % GROUP_COLUMNS;
    }
};

// A group of the area by its row and column among these: those of the tile are in rows 1 and 2 and columns 1 to 4.
struct AreaGroup {
    uint row;
    uint column;

    // Group number `part` of the tile.
    __device__ __forceinline__ static AreaGroup of_tile(uint part) { return {part / 4 + 1, part % 4 + 1}; }
    // Two around the tile for each of eight warps.
    __device__ __forceinline__ static AreaGroup around(uint warp, uint which) {
        uint column = warp % 4, half = warp / 4;
        if (which == 0) return {half * 3, column + 1};
        bool is_beside = column == 0 || column == 3;
        return {is_beside ? half + 1 : half * 3, column < 2 ? 0u : 5u};
    }
    // Number `which` of those around a group of the tile, row by row.
    __device__ __forceinline__ AreaGroup next_to(uint which) const { return {row + which / 3 - 1, column + which % 3 - 1}; }
    __device__ __forceinline__ GroupPlace place(uint first_row, uint first_column) const {
        return {first_row + (row - 1) * GROUP_ROWS, first_column + (column - 1) * GROUP_COLUMNS};
    }
    // The entry of its particle of a lane.
    __device__ __forceinline__ uint entry(uint lane) const {
        return (row * GROUP_ROWS + lane / GROUP_COLUMNS) * AREA_STRIDE + column * GROUP_COLUMNS + lane % GROUP_COLUMNS;
    }
};
