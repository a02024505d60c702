// What a warp looks for the partners of a group of the tile with, and where a block keeps what warps find.

// Room for the particles that a group is compared with, the last of it for those from elsewhere, or for the forces of its pairs in contact,
// which are twice as large; for particles from elsewhere that are kept; and for partners of one particle that are in the area, and that are
// not.
#define AREA_MEMBERS (16 * GROUP)
#define AREA_PAIRS (AREA_MEMBERS / 2)
#define AREA_FAR_MEMBERS (9 * GROUP + AREA_AT_ONCE)
#define AREA_FAR_KEPT 64
#define AREA_PARTNERS_HERE 15
#define AREA_PARTNERS_FAR 16
// Their numbers take five bits (`area_sum.cuh`).
static_assert(AREA_PARTNERS_HERE + AREA_PARTNERS_FAR < 32, "partners of a particle are numbered in five bits");
// Groups from elsewhere that may be near one.
#define AREA_FAR_GROUPS 48
// Particles in shared memory: those of the area, then others that are kept, for each group.
#define AREA_KEPT (AREA_ENTRIES + TILE_GROUPS * AREA_FAR_KEPT)
// Particles that are compared without a look at what was found.
#define AREA_AT_ONCE 16
// The warp that searches in the area has a group and five others at most, beside what another warp has from elsewhere at the same time.
static_assert(6 * GROUP + AREA_AT_ONCE + AREA_FAR_MEMBERS <= AREA_MEMBERS, "two warps share the room for what is compared");
// In place of an entry, for what there is no room for.
#define AREA_IN_PACKETS 0xffffu

// What a block has in shared memory of dynamic size, one after the other; of addresses that are known when this is compiled, so that
// nobody has to keep them.
extern __shared__ __align__(16) unsigned char frame_memory[];

// Positions and velocities.
__device__ __forceinline__ real4* area_x() { return (real4*)frame_memory; }
__device__ __forceinline__ real4* area_v() { return area_x() + AREA_KEPT; }
// For each group what is to be compared: particles as seen from its middle; later forces of pairs. And what the particles are called, number
// above and entry below.
__device__ __forceinline__ real4* area_pairs() { return area_v() + AREA_KEPT; }
__device__ __forceinline__ Sketch* area_sketches() { return (Sketch*)area_pairs(); }
__device__ __forceinline__ uint* area_keys() { return (uint*)(area_pairs() + TILE_GROUPS * AREA_PAIRS); }
// What may be in contact with each particle of the tile, so named and in no order: in the area, then elsewhere. What is, is known when forces are
// summed.
__device__ __forceinline__ uint* area_partners() { return area_keys() + TILE_GROUPS * AREA_MEMBERS; }
__device__ __forceinline__ real* area_forces() { return (real*)(area_partners() + (AREA_PARTNERS_HERE + AREA_PARTNERS_FAR) * TILE_PARTICLES); }
// The list of each group of the tile.
__device__ __forceinline__ unsigned short* area_list(const Solver& s, uint part) { return (unsigned short*)(area_forces() + 3 * STENCIL_FORCES) + part * s.group_count; }

// What a warp looks for partners with: a group of the tile, and the particle of the lane.
struct AreaView {
    GroupPlace tile;
    uint part;
    uint lane;
    // The particle of the lane: its entry, and what it is called.
    uint at;
    uint key;
    bool exists;

    // Of a substep: where partners may be, by its middle and how far it reaches from there along each axis; and how the particle is compared.
    vec3 middle;
    vec3 half;
    SketchView sketch;
    // How many there are to be compared, and how many may be partners.
    uint count;
    uint found;

    __device__ __forceinline__ AreaView(const Solver& s, const GroupPlace& tile, uint part, uint lane) : tile(tile), part(part), lane(lane), found(0) {
        AreaGroup group = AreaGroup::of_tile(part);
        GroupPlace place = group.place(tile.row, tile.column);
        at = group.entry(lane);
        key = place.particle(s, lane) << 16 | at;
        exists = place.has(s, lane);
    }

    // The particle of a lane among those of the tile, row by row.
    __device__ __forceinline__ uint number(uint lane) const {
        return (part / 4 * GROUP_ROWS + lane / GROUP_COLUMNS) * TILE_COLUMNS + part % 4 * GROUP_COLUMNS + lane % GROUP_COLUMNS;
    }

    // The substep begins: gives the box of the group.
    __device__ __forceinline__ Box look(const Solver& s) {
        Box box = warp_box_finite(exists, xyz(area_x()[at]));
        middle = (real)0.5 * (box.low + box.high);
        half = box.high - middle;
        // No less than `contact_reach`, in fewer operations.
        real extent = fmax(fmax(half.x, half.y), half.z) + fmax(fmax(absolute(middle.x), absolute(middle.y)), absolute(middle.z));
        real reach = (real)1.001 * s.contact_distance + (real)32 * REAL_EPSILON * extent;
        half = {half.x + reach, half.y + reach, half.z + reach};
        return box;
    }

    // The particle of the lane as it is to be compared.
    __device__ __forceinline__ Sketch see(const Solver& s) {
        sketch.scale_to((float)fmax(fmax(half.x, half.y), half.z));
        return sketch.see(exists, xyz(area_x()[at]) - middle, (float)s.contact_distance);
    }

    __device__ __forceinline__ bool is_in_reach(const vec3& seen) const { return absolute(seen.x) <= half.x & absolute(seen.y) <= half.y & absolute(seen.z) <= half.z; }

    // Those of a group that are in reach are to be compared. `first` is where what there is to be compared starts.
    __device__ __forceinline__ void take(uint first, uint inside, const vec3& seen, uint key) {
        uint slot = first + count + __popc(inside & ((1u << lane) - 1));
        if (inside >> lane & 1) {
            area_sketches()[slot] = sketch.of(seen);
            area_keys()[slot] = key;
        }
        count += __popc(inside);
    }

    // Nothing more is to be compared: what comes after is nowhere near, so that as many as are compared at once need no look at how many there are.
    __device__ __forceinline__ void members_end(uint first) const {
        if (lane < AREA_AT_ONCE) area_sketches()[first + count + lane] = SKETCH_NOWHERE;
        __syncwarp();
    }

    // Looks for what may be in contact with the particles of the group, but for those that `skipped` has of the first 32. From `partners` on
    // there is room for so many of each particle.
    __device__ __forceinline__ void find(uint first, uint end, uint skipped, uint* partners, uint room) {
#pragma unroll 1
        for (; first < end; first += AREA_AT_ONCE) {
            uint hits = sketch.near<AREA_AT_ONCE>(area_sketches() + first) & ~skipped;
            skipped >>= AREA_AT_ONCE;
            // Two at a time, so that their keys are on their way together.
            while (hits != 0) {
                uint rest = hits & (hits - 1), one = __ffs(hits) - 1, other = rest != 0 ? __ffs(rest) - 1 : one;
                uint keys[2] = {area_keys()[first + one], area_keys()[first + other]};
                if (found < room) partners[number(lane) + found * TILE_PARTICLES] = keys[0];
                found++;
                if (rest != 0 && found < room) partners[number(lane) + found * TILE_PARTICLES] = keys[1];
                found += rest != 0 ? 1 : 0;
                hits = rest & (rest - 1);
            }
        }
    }

    // The group of the list that is that of the lane, from number `first` on.
    __device__ __forceinline__ uint listed_group(const Solver& s, uint first, uint listed) const {
        return first + lane < listed ? area_list(s, part)[first + lane] : NONE;
    }

    // Which of 32 groups of the list are near, one for each lane, whose box is on its way.
    __device__ __forceinline__ uint near_groups(const AreaPackets& packets, uint other, Coming& coming) const {
        bool meets = false;
        if (other != NONE) {
            Box box;
            packets.box_wait(other, coming, box);
            // As `boxes_meet`, without branches: twice what is between their middles.
            vec3 between = box.low + box.high - (real)2 * middle, extent = box.high - box.low + (real)2 * half;
            meets = absolute(between.x) <= extent.x & absolute(between.y) <= extent.y & absolute(between.z) <= extent.z;
        }
        return __ballot_sync(ALL_LANES, meets);
    }
};
