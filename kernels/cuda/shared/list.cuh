// NUMERICS section 8: the candidate list and the proof that it is complete.
//
// When the list is built, particle i is at r_i and is expected to move as p_i(t) = r_i + t (u + q_i), t uses
// of the list later, u the drift of everything, up to a horizon. The list holds each pair that comes closer than d + 2 a on these
// straight lines, looked for among all pairs closer than the size c of a cell. No pair in contact is
// missing as long as, for every particle, |x_i - p_i(t)| <= a and |x_i - r_i - t u| <= (c - d) / 2: a pair that was not looked at had a gap of more than c - d.

#define MOTION_STEPS 127
// Near particles that a thread keeps until it looks at them closer.
#define NEAR_MAX 64

// q as a number of 24 bits; a double precision solver keeps it in the same way.
__device__ __forceinline__ uint motion_byte(const Solver& s, real q) {
    real scaled = q * ((real)MOTION_STEPS / s.list_motion_max);
    scaled = minimum(maximum(scaled, (real)-MOTION_STEPS), (real)MOTION_STEPS);
    return (uint)((int)scaled + 128);
}

__device__ __forceinline__ real motion_unpack_axis(const Solver& s, uint packed, uint axis) {
    int steps = (int)((packed >> (8 * axis)) & 255u) - 128;
    return (real)steps * (s.list_motion_max / (real)MOTION_STEPS);
}

// The motion per use relative to the drift.
__device__ __forceinline__ vec3 motion_unpack(const Solver& s, real word) {
    uint packed = (uint)word;
    return {motion_unpack_axis(s, packed, 0), motion_unpack_axis(s, packed, 1), motion_unpack_axis(s, packed, 2)};
}

// How the present list was built.
struct ListState {
    vec3 drift;
    real horizon;
    uint tick;
};

__device__ __forceinline__ ListState list_state(const Solver& s) {
    const Status* status = s.status;
    return {
        {(real)status->drift[0], (real)status->drift[1], (real)status->drift[2]},
        (real)status->horizon,
        status->built_tick,
    };
}

// Whether the list is complete at this use as far as this particle can tell.
__device__ __forceinline__ bool list_holds(const Solver& s, const ListState& list, uint i, const vec3& x, uint tick) {
    real4 reference = s.reference[i];
    real elapsed = (real)(tick - list.tick);
    vec3 moved = (x - xyz(reference)) - elapsed * list.drift;
    vec3 strayed = moved - elapsed * motion_unpack(s, reference.w);
    // Written so that a NaN counts as too far.
    return dot(moved, moved) <= s.list_reach * s.list_reach && dot(strayed, strayed) <= s.list_allowance * s.list_allowance
        && elapsed <= list.horizon;
}

__device__ __forceinline__ int cell_coordinate(const Solver& s, real x) {
    real scaled = x * s.cells_per_metre;
    scaled = minimum(maximum(scaled, (real)-1e9), (real)1e9);
    int truncated = (int)scaled;
    return truncated - ((real)truncated > scaled ? 1 : 0);
}

__device__ __forceinline__ uint cell_index(const Solver& s, int x, int y, int z) {
    uint cx = (uint)x & (s.cells[0] - 1), cy = (uint)y & (s.cells[1] - 1), cz = (uint)z & (s.cells[2] - 1);
    return (cz * s.cells[1] + cy) * s.cells[0] + cx;
}

// Whether two particles come closer than the distance of the list on their expected ways. `dq` is
// relative motion per use.
__device__ __forceinline__ bool comes_close(const Solver& s, const vec3& d, const vec3& dq, real distance) {
    real square = maximum(dot(dq, dq), (real)1e-30);
    real t = minimum(maximum(-dot(d, dq) / square, (real)0), s.list_horizon);
    vec3 closest = d + t * dq;
    return dot(closest, closest) < distance * distance;
}

// Adds the particle at a place of the sorted ones to the row of particle i if it can come into contact and nothing
// leaves it out.
__device__ __forceinline__ void list_add(const Solver& s, uint i, const real4& own, uint place, real distance, uint& found) {
    uint j = s.sorted_index[place];
    real4 other = s.sorted[place];
    vec3 dq = motion_unpack(s, other.w) - motion_unpack(s, own.w);
    if (j == i || !comes_close(s, xyz(other) - xyz(own), dq, distance)) return;
    SpringRow row = spring_row(s, i);
    bool joined = false;
#pragma unroll 4
    for (uint k = 0; k < row.count; k++) joined |= i + spring_entry(s, row, k).x == j;
    if (joined) return;
    if (s.contact & CONTACT_IMPULSE) {
        vec3 rest = xyz(s.rest[i]) - xyz(s.rest[j]);
        if (dot(rest, rest) < s.contact_distance * s.contact_distance) return;
    }
    if (found < s.candidate_capacity) {
        uint k = found;
        while (k > 0) {
            uint before = s.candidates[(size_t)(k - 1) * s.count + i];
            if (before < j) break;
            s.candidates[(size_t)k * s.count + i] = before;
            k--;
        }
        s.candidates[(size_t)k * s.count + i] = j;
    }
    found++;
}

// Builds the row of particle i, ascending. Returns the number of candidates, which may be more than fit.
__device__ __forceinline__ uint list_row(const Solver& s, uint i) {
    // In registers: the loop below is nearly all of the work.
    const real4* sorted = s.sorted;
    const uint* starts = s.cell_starts;
    uint mask_x = s.cells[0] - 1, mask_y = s.cells[1] - 1, mask_z = s.cells[2] - 1;
    uint width = s.cells[0], height = s.cells[1];
    real4 own = s.reference[i];
    vec3 r = xyz(own);
    uint packed = (uint)own.w;
    real extent = maximum(maximum(absolute(r.x), absolute(r.y)), absolute(r.z));
    real distance = s.list_distance + (real)32 * REAL_EPSILON * extent;
    real step = (real)1.001 * s.list_horizon * (s.list_motion_max / (real)MOTION_STEPS);
    int cx = cell_coordinate(s, r.x), cy = cell_coordinate(s, r.y), cz = cell_coordinate(s, r.z);
    uint left = (uint)(cx - 1) & mask_x, right = (uint)(cx + 1) & mask_x;
    bool whole = left + 2 == right;
    uint found = 0;
    // What is near is looked at closer in a loop of its own, as threads of a warp come upon it at different times.
    uint near[NEAR_MAX];
    uint near_count = 0;
    for (int k = 0; k < 9; k++) {
        uint row = (((uint)(cz + k / 3 - 1) & mask_z) * height + ((uint)(cy + k % 3 - 1) & mask_y)) * width;
        // The three cells of a row lie side by side, unless the period comes between.
        for (uint part = 0; part < (whole ? 1u : 2u); part++) {
            uint from = row + (whole || part == 0 ? left : 0);
            uint to = row + (whole || part == 1 ? right : mask_x);
            uint end = starts[to + 1];
#pragma unroll 4
            for (uint place = starts[from]; place < end; place++) {
                real4 other = sorted[place];
                vec3 d = xyz(other) - r;
                // Most are too far away for any motion between the two: steps of all axes together.
                real reach = distance + step * (real)__vsadu4(packed, (uint)other.w);
                if (dot(d, d) < reach * reach) {
                    if (near_count < NEAR_MAX) near[near_count++] = place;
                    else list_add(s, i, own, place, distance, found);
                }
            }
        }
    }
    for (uint k = 0; k < near_count; k++) list_add(s, i, own, near[k], distance, found);
    return found;
}
