// NUMERICS section 8: pairs in contact, by groups.
//
// When the list is built each group is given a region that it is expected to stay in for a while: around its
// particles and where they get to at their present velocities, and a margin more. The list of a group names the
// groups whose regions come within the contact distance of its own. As long as all groups are within their
// regions, no pair in contact is in groups that the list does not name.

// Members of a group that are compared one by one; of more, all are at once.
#define MEMBERS_FEW 10

__device__ __forceinline__ bool is_joined(const Solver& s, uint i, uint j) {
    SpringRow row = spring_row(s, i);
    bool joined = false;
#pragma unroll 4
    for (uint k = 0; k < row.count; k++) joined |= i + spring_entry(s, row, k).x == j;
    return joined;
}

// Calls `visit` for every particle in contact with that of the lane, also those that are left out, in no particular
// order: with its group, its place there, its position and number. All lanes of the warp take part, but `visit` is called
// by one alone. `stage` is shared memory of the warp, one entry for each lane.
template <typename Visit>
__device__ __forceinline__ void group_contacts_visit(const Solver& s, uint side, uint group, uint lane, real4* stage, Visit visit) {
    const real4* positions = s.group_positions[side];
    vec3 xi = xyz(positions[group * GROUP + lane]);
    Box box = box_load(s.group_boxes[side], group);
    box = box_grown(box, contact_reach(s, box));
    real square = s.contact_distance * s.contact_distance;
    uint listed = min(s.group_counts[group], s.group_capacity);
    for (uint first = 0; first < listed; first += 32) {
        bool near = false;
        uint other = group;
        if (first + lane < listed) {
            other = s.group_rows[group * s.group_capacity + first + lane];
            near = boxes_meet(box, box_load(s.group_boxes[side], other));
        }
        uint left = __ballot_sync(ALL_LANES, near);
        uint at = left == 0 ? group : __shfl_sync(ALL_LANES, other, __ffs(left) - 1);
        real4 next = positions[at * GROUP + lane];
        while (left != 0) {
            real4 theirs = next;
            uint present = at;
            left &= left - 1;
            if (left != 0) {
                at = __shfl_sync(ALL_LANES, other, __ffs(left) - 1);
                next = positions[at * GROUP + lane];
            }
            uint inside = __ballot_sync(ALL_LANES, box_holds(box, xyz(theirs)));
            if (inside == 0) continue;
            stage[lane] = theirs;
            __syncwarp();
            uint hits = 0;
            if (__popc(inside) > MEMBERS_FEW) {
#pragma unroll
                for (uint k = 0; k < GROUP; k++) {
                    hits |= pair_of(xi, xyz(stage[k])).length_squared < square ? 1u << k : 0;
                }
                hits &= inside;
            } else {
                while (inside != 0) {
                    uint k = __ffs(inside) - 1;
                    inside &= inside - 1;
                    hits |= pair_of(xi, xyz(stage[k])).length_squared < square ? 1u << k : 0;
                }
            }
            if (present == group) hits &= ~(1u << lane);
            while (hits != 0) {
                uint k = __ffs(hits) - 1;
                hits &= hits - 1;
                visit(present, k, stage[k]);
            }
            __syncwarp();
        }
    }
}

// Puts particle j into the row of particle i, ascending, unless the pair is left out. Gives how many the row has, which
// may be more than fit.
__device__ __noinline__ uint candidate_add(const Solver& s, uint i, uint j, uint found) {
    if (is_joined(s, i, j)) return found;
    if (s.contact & CONTACT_IMPULSE) {
        vec3 rest = xyz(s.rest[i]) - xyz(s.rest[j]);
        if (dot(rest, rest) < s.contact_distance * s.contact_distance) return found;
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
    return found + 1;
}

// Fills the row of the particle of each lane of a group. Gives how many partners the row has.
__device__ __forceinline__ uint group_contacts(const Solver& s, uint side, uint group, uint lane, real4* stage) {
    uint i = number_unpack(s.group_positions[side][group * GROUP + lane].w);
    uint found = 0;
    group_contacts_visit(s, side, group, lane, stage, [&](uint, uint, const real4& other) {
        found = candidate_add(s, i, number_unpack(other.w), found);
    });
    if (found > s.candidate_capacity) atomicMax(&s.status->overflow, found);
    if (i != NONE) s.candidate_counts[i] = min(found, s.candidate_capacity);
    return found;
}

// The rows of all particles; all warps take part.
__device__ __forceinline__ void contacts_find(const Solver& s, uint side, real4* stage) {
    uint lane = threadIdx.x & 31;
    uint warps = gridDim.x * blockDim.x / 32;
    for (uint group = (blockIdx.x * blockDim.x + threadIdx.x) / 32; group < s.group_count; group += warps) {
        group_contacts(s, side, group, lane, stage);
    }
}
