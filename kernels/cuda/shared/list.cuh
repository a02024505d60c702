// NUMERICS section 8: pairs in contact, by groups.
//
// When the list is built each group is given a region that it is expected to stay in for a while: around its
// particles and where they get to at their present velocities, and a margin more. The list of a group names the
// groups whose regions come within the contact distance of its own. As long as all groups are within their
// regions, no pair in contact is in groups that the list does not name.

// What `built` of the status is if there is a list, and if there are directions of tiles too (`flat.cuh`).
#define LIST_BUILT 1
#define LIST_BUILT_WITH_TILES 2

// Members of a group that are compared one by one; of more, all are at once.
#define MEMBERS_FEW 10

__device__ __forceinline__ bool is_joined(const Solver& s, uint i, uint j) {
    SpringRow row = spring_row(s, i);
    bool joined = false;
#pragma unroll 4
    for (uint k = 0; k < row.count; k++) joined |= i + spring_entry(s, row, k).x == j;
    return joined;
}

// Whether an edge of a triangle of fabric joins two particles.
__device__ __forceinline__ bool is_edge(const Solver& s, uint i, uint j) {
    if (s.element_count == 0) return false;
    bool joined = false;
    uint end = s.membrane_rows[i + 1];
    for (uint at = s.membrane_rows[i]; at < end; at++) {
        const uint* corners = s.membranes[s.membrane_entries[at] / 3].particles;
        joined |= corners[0] == j || corners[1] == j || corners[2] == j;
    }
    return joined;
}

// What a group looks for partners with: the particle of the lane, and how far around the group they may be.
struct GroupView {
    vec3 x;
    Box box;

    template <typename Groups> __device__ __forceinline__ static GroupView of(const Solver& s, const Groups& groups, uint group, uint lane) {
        real4 position = groups.position(group, lane);
        Box box = groups.box_now(group, position);
        return {xyz(position), box_grown(box, contact_reach(s, box))};
    }
};

// Members of a group that are compared at once, where there are registers for it.
#ifdef CLOTH_MANY_REGISTERS
#define MEMBERS_BATCH 4
#else
#define MEMBERS_BATCH 1
#endif

// Groups of its list, one for each lane, and which are near it; the positions of the first of these are on their way.
struct NearGroups {
    uint other;
    uint left;
    uint at;
    real4 next;

    // `listed` says that the lane has one, `other`.
    template <typename Groups> __device__ __forceinline__ static NearGroups of(const Groups& groups, const Box& box, uint lane, bool listed, uint other) {
        NearGroups near;
        near.other = other;
        near.left = __ballot_sync(ALL_LANES, listed && boxes_meet(box, groups.box(other)));
        near.load(groups, lane);
        return near;
    }

    // If there is none left, any.
    template <typename Groups> __device__ __forceinline__ void load(const Groups& groups, uint lane) {
        at = __shfl_sync(ALL_LANES, other, left == 0 ? 0 : __ffs(left) - 1);
        next = groups.position(at, lane);
    }
};

// The entry of a lane in the list of a group, from `first` on; the group itself if there is none.
__device__ __forceinline__ uint list_entry(const Solver& s, uint group, uint lane, uint first, uint listed) {
    return first + lane < listed ? s.group_rows[group * s.group_capacity + first + lane] : group;
}

// Groups in the list of one.
__device__ __forceinline__ uint list_count(const Solver& s, uint group) { return min(s.group_counts[group], s.group_capacity); }

// Which members of a group, in shared memory, are in contact with the particle of the lane: of those in its box, `inside`, a bit each.
__device__ __forceinline__ uint members_in_contact(const Solver& s, const GroupView& view, const real4* members, uint inside) {
    real square = s.contact_distance * s.contact_distance;
    uint hits = 0;
    if (__popc(inside) > MEMBERS_FEW) {
#pragma unroll
        for (uint k = 0; k < GROUP; k++) hits |= pair_of(view.x, xyz(members[k])).length_squared < square ? 1u << k : 0;
        return hits & inside;
    }
    while (inside != 0) {
        // Of fewer than a batch, the first stands for those that are missing.
        uint batch[MEMBERS_BATCH];
#pragma unroll
        for (uint k = 0; k < MEMBERS_BATCH; k++) {
            batch[k] = k == 0 || inside != 0 ? __ffs(inside) - 1 : batch[0];
            inside &= inside - 1;
        }
#pragma unroll
        for (uint k = 0; k < MEMBERS_BATCH; k++) {
            hits |= pair_of(view.x, xyz(members[batch[k]])).length_squared < square ? 1u << batch[k] : 0;
        }
    }
    return hits;
}

// Calls `visit` for every particle in contact with that of the lane, also those that are left out, in no particular
// order: with its group, its place there, its position and number. All lanes of the warp take part, but `visit` is called
// by one alone. `near` are the first of the `listed` groups. `stage` is shared memory of the warp, one entry for each lane.
template <typename Groups, typename Visit>
__device__ __forceinline__ void group_contacts_visit(
    const Solver& s, const Groups& groups, uint group, uint lane, const GroupView& view, NearGroups near, uint listed, real4* stage, Visit visit
) {
    for (uint first = 0; first < listed; first += 32) {
        if (first > 0) near = NearGroups::of(groups, view.box, lane, first + lane < listed, list_entry(s, group, lane, first, listed));
        while (near.left != 0) {
            real4 theirs = near.next;
            uint present = near.at;
            near.left &= near.left - 1;
            if (near.left != 0) near.load(groups, lane);
            uint inside = __ballot_sync(ALL_LANES, box_holds(view.box, xyz(theirs)));
            if (inside == 0) continue;
            stage[lane] = theirs;
            __syncwarp();
            uint hits = members_in_contact(s, view, stage, inside);
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
        if (dot(rest, rest) < s.contact_distance * s.contact_distance || is_edge(s, i, j)) return found;
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

// Partners that a thread keeps by itself while it looks for them.
#define PARTNERS_KEPT 24

// Puts a number among `count` ascending ones, as far as there is room.
__device__ __forceinline__ void number_add(uint* numbers, uint count, uint number) {
    if (count >= PARTNERS_KEPT) return;
    uint k = count;
    while (k > 0 && numbers[k - 1] > number) {
        numbers[k] = numbers[k - 1];
        k--;
    }
    numbers[k] = number;
}

// Writes the row of particle i from `count` ascending partners, less those that are left out. Gives how many the row has.
__device__ __forceinline__ uint row_write(const Solver& s, uint i, const uint* partners, uint count) {
    SpringRow row = spring_row(s, i);
    bool by_rest = (s.contact & CONTACT_IMPULSE) != 0;
    vec3 rest = by_rest ? xyz(s.rest[i]) : make_vec3(0, 0, 0);
    uint found = 0, place = 0;
    uint joined = row.count > 0 ? i + spring_entry(s, row, 0).x : NONE;
    for (uint k = 0; k < count; k++) {
        uint j = partners[k];
        // Both are ascending.
        while (joined < j) {
            place++;
            joined = place < row.count ? i + spring_entry(s, row, place).x : NONE;
        }
        if (joined == j) continue;
        if (by_rest) {
            vec3 apart = rest - xyz(s.rest[j]);
            if (dot(apart, apart) < s.contact_distance * s.contact_distance || is_edge(s, i, j)) continue;
        }
        if (found < s.candidate_capacity) s.candidates[(size_t)found * s.count + i] = j;
        found++;
    }
    return found;
}

// Fills the row of the particle of each lane of a group. Gives how many partners the row has.
template <typename Groups> __device__ __forceinline__ uint group_contacts(const Solver& s, const Groups& groups, uint group, uint lane, real4* stage) {
    uint i = number_unpack(groups.position(group, lane).w);
    uint found = 0;
    uint kept[PARTNERS_KEPT];
    GroupView view = GroupView::of(s, groups, group, lane);
    uint listed = list_count(s, group);
    NearGroups near = NearGroups::of(groups, view.box, lane, lane < listed, list_entry(s, group, lane, 0, listed));
    group_contacts_visit(s, groups, group, lane, view, near, listed, stage, [&](uint, uint, const real4& other) {
        number_add(kept, found, number_unpack(other.w));
        found++;
    });
    if (__any_sync(ALL_LANES, found > PARTNERS_KEPT)) {
        // Once more, into rows in memory.
        found = 0;
        near = NearGroups::of(groups, view.box, lane, lane < listed, list_entry(s, group, lane, 0, listed));
        group_contacts_visit(s, groups, group, lane, view, near, listed, stage, [&](uint, uint, const real4& other) {
            found = candidate_add(s, i, number_unpack(other.w), found);
        });
    } else if (found > 0) {
        found = row_write(s, i, kept, found);
    }
    if (found > s.candidate_capacity) atomicMax(&s.status->overflow, found);
    if (i != NONE) s.candidate_counts[i] = min(found, s.candidate_capacity);
    return found;
}

// The rows of all particles; all warps take part.
__device__ __forceinline__ void contacts_find(const Solver& s, uint side, real4* stage) {
    uint lane = threadIdx.x & 31;
    uint warps = gridDim.x * blockDim.x / 32;
    for (uint group = warp_number(); group < s.group_count; group += warps) {
        group_contacts(s, GroupsStored{s, side}, group, lane, stage);
    }
}
