// NUMERICS section 8: groups of 32 particles that lie near each other at rest, and the boxes they are in.
//
// A warp takes a group, a lane a particle. Positions by group are kept with the particles' numbers, as that is
// what other groups look at: one load for both, side by side.

#define GROUP 32
#define WARP 32
#define ALL_LANES 0xffffffffu
#define NONE 0xffffffffu

struct Box {
    vec3 low;
    vec3 high;
};

#ifdef CLOTH_F64
__device__ __forceinline__ real number_pack(uint number) { return __longlong_as_double((long long)number); }
__device__ __forceinline__ uint number_unpack(real word) { return (uint)__double_as_longlong(word); }
__device__ __forceinline__ real warp_minimum(real a) {
    for (uint width = 16; width > 0; width /= 2) a = minimum(a, __shfl_xor_sync(ALL_LANES, a, width));
    return a;
}
#else
__device__ __forceinline__ real number_pack(uint number) { return __uint_as_float(number); }
__device__ __forceinline__ uint number_unpack(real word) { return __float_as_uint(word); }
// Integers in the order of the numbers.
__device__ __forceinline__ int ordered(int bits) { return bits ^ ((bits >> 31) & 0x7fffffff); }
__device__ __forceinline__ real warp_minimum(real a) {
    return __int_as_float(ordered(__reduce_min_sync(ALL_LANES, ordered(__float_as_int(a)))));
}
#endif
__device__ __forceinline__ real warp_maximum(real a) { return -warp_minimum(-a); }

__device__ __forceinline__ Box box_load(const real4* boxes, uint group) {
    return {xyz(boxes[2 * group]), xyz(boxes[2 * group + 1])};
}

// Written by the lanes of a warp together.
__device__ __forceinline__ void box_store(real4* boxes, uint group, uint lane, const Box& box) {
    if (lane < 2) boxes[2 * group + lane] = with_w(lane == 0 ? box.low : box.high, 0);
}

// Those of all lanes; a coordinate that is not a number counts for nothing.
__device__ __forceinline__ Box warp_box(bool exists, const vec3& low, const vec3& high) {
    Box box;
    box.low.x = warp_minimum(exists ? minimum(low.x, REAL_MAX) : REAL_MAX);
    box.low.y = warp_minimum(exists ? minimum(low.y, REAL_MAX) : REAL_MAX);
    box.low.z = warp_minimum(exists ? minimum(low.z, REAL_MAX) : REAL_MAX);
    box.high.x = warp_maximum(exists ? maximum(high.x, -REAL_MAX) : -REAL_MAX);
    box.high.y = warp_maximum(exists ? maximum(high.y, -REAL_MAX) : -REAL_MAX);
    box.high.z = warp_maximum(exists ? maximum(high.z, -REAL_MAX) : -REAL_MAX);
    return box;
}

// That of the particles of the lanes that have one, all of them finite.
__device__ __forceinline__ Box warp_box_finite(bool exists, const vec3& x) {
#ifdef CLOTH_F64
    return warp_box(exists, x, x);
#else
    auto axis = [exists](float a, float& low, float& high) {
        int number = ordered(__float_as_int(a));
        low = __int_as_float(ordered(__reduce_min_sync(ALL_LANES, exists ? number : 0x7f7fffff)));
        high = __int_as_float(ordered(__reduce_max_sync(ALL_LANES, exists ? number : (int)0x80800000)));
    };
    Box box;
    axis(x.x, box.low.x, box.high.x);
    axis(x.y, box.low.y, box.high.y);
    axis(x.z, box.low.z, box.high.z);
    return box;
#endif
}

// Larger by this much on all sides.
__device__ __forceinline__ Box box_grown(const Box& box, real by) {
    return {{box.low.x - by, box.low.y - by, box.low.z - by}, {box.high.x + by, box.high.y + by, box.high.z + by}};
}

__device__ __forceinline__ bool box_holds(const Box& box, const vec3& x) {
    return x.x >= box.low.x && x.y >= box.low.y && x.z >= box.low.z && x.x <= box.high.x && x.y <= box.high.y && x.z <= box.high.z;
}

__device__ __forceinline__ bool boxes_meet(const Box& a, const Box& b) {
    return a.low.x <= b.high.x && a.low.y <= b.high.y && a.low.z <= b.high.z && b.low.x <= a.high.x && b.low.y <= a.high.y && b.low.z <= a.high.z;
}

// How far to look for contact around a box: the distance, and what rounding may take away.
__device__ __forceinline__ real contact_reach(const Solver& s, const Box& box) {
    vec3 a = box.low, b = box.high;
    real extent = maximum(maximum(maximum(-a.x, b.x), maximum(-a.y, b.y)), maximum(-a.z, b.z));
    extent = maximum(extent, maximum(maximum(a.x, a.y), a.z));
    return (real)1.001 * s.contact_distance + (real)32 * REAL_EPSILON * maximum(extent, 0);
}

// Puts the particles of a group where others look, side `side` of two. Says whether the group is within the region
// that the present list was made for.
__device__ __forceinline__ bool group_store(const Solver& s, uint side, uint group, uint lane, bool exists, const vec3& x, uint i) {
    real none = number_pack(NONE);
    Box region = box_load(s.group_regions, group);
    real nowhere = REAL_MAX;
    s.group_positions[side][group * GROUP + lane] = exists ? with_w(x, number_pack(i)) : real4{nowhere, nowhere, nowhere, none};
    Box box = warp_box(exists, x, x);
    box_store(s.group_boxes[side], group, lane, box);
    // Written so that it holds for a group without particles, and not for what is not a number.
    return !exists || box_holds(region, x);
}

// The number of the warp among those of all blocks: neighbours are in different blocks, so that no multiprocessor has more groups than
// others.
__device__ __forceinline__ uint warp_number() { return threadIdx.x / 32 * gridDim.x + blockIdx.x; }

// The same for all groups, by the particles of `x`; all warps take part. Says whether all are within their regions.
__device__ __forceinline__ bool groups_store(const Solver& s, uint side, const real4* x) {
    uint lane = threadIdx.x & 31;
    uint warps = gridDim.x * blockDim.x / 32;
    bool holds = true;
    for (uint group = warp_number(); group < s.group_count; group += warps) {
        uint i = s.group_members[group * GROUP + lane];
        bool exists = i != NONE;
        vec3 at = exists ? xyz(x[i]) : make_vec3(0, 0, 0);
        holds &= group_store(s, side, group, lane, exists, at, i);
    }
    return holds;
}

// Where a group finds the particles of others, and boxes around them: as they were stored.
struct GroupsStored {
    const Solver& s;
    uint side;

    // Position and number.
    __device__ __forceinline__ real4 position(uint group, uint lane) const { return s.group_positions[side][group * GROUP + lane]; }
    __device__ __forceinline__ Box box(uint group) const { return box_load(s.group_boxes[side], group); }
    // Of a group whose particle of this lane is known.
    __device__ __forceinline__ Box box_now(uint group, const real4&) const { return box(group); }
};
