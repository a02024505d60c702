// How another warp searches for the partners of the group in groups from elsewhere that are near.

// A group of the list, one of a lane: its number, NONE if there is none; where it is in the patch (`GroupPlace::pack`); and its box on its way.
struct ListedGroup {
    uint group;
    uint place;
    Coming box;

    // That of the lane, from number `first` on.
    __device__ __forceinline__ void find(const Solver& s, const AreaView& view, uint first, uint listed) {
        group = view.listed_group(s, first, listed);
        place = GroupPlace::of(s, group).pack();
    }
};

// What the warp that searches in the area tells the one that searches in other groups: which of these are near, and where it looks.
struct FarGroups {
    vec3 middle;
    vec3 half;
    // Opens once for each search, when they are known.
    ulong gate;
    // As many as there are, also those that there is no room for.
    uint count;
    uint places[AREA_FAR_GROUPS];

    // The groups of the list that are near, of which each lane has one of the first and has asked for its box; all lanes of a warp.
    __device__ __forceinline__ void fill(const Solver& s, const AreaView& view, const AreaPackets& packets, uint listed, ListedGroup other) {
        uint found = 0;
#pragma unroll 1
        for (uint first = 0; first < listed; first += 32) {
            if (first > 0) {
                other.find(s, view, first, listed);
                packets.box_ask(other.group, other.box);
            }
            uint near = view.near_groups(packets, other.group, other.box), slot = found + __popc(near & ((1u << view.lane) - 1));
            if (near >> view.lane & 1 && slot < AREA_FAR_GROUPS) places[slot] = other.place;
            found += __popc(near);
        }
        if (view.lane == 0) {
            middle = view.middle;
            half = view.half;
            count = found;
        }
        gate_arrive(&gate);
    }
};

// A group that is near, and its particles on their way, one of a lane each.
struct FarGroup {
    GroupPlace place;
    Coming coming;
};

struct FarSearch : AreaView {
    // How many particles are kept.
    uint kept;
    // Of the groups that are near the next two, those of even numbers and of odd ones in turn.
    FarGroup even;
    FarGroup odd;

    __device__ __forceinline__ FarSearch(const Solver& s, const GroupPlace& tile, uint part, uint lane) : AreaView(s, tile, part, lane) {}

    __device__ __forceinline__ uint members_first() const { return (part + 1) * AREA_MEMBERS - AREA_FAR_MEMBERS; }

    // Asks for the particles of one of the groups that are near, if there is one of that number.
    __device__ __forceinline__ void ask(const Solver& s, const AreaPackets& packets, const FarGroups& groups, uint k, FarGroup& group) const {
        if (k >= groups.count) return;
        group.place = GroupPlace::unpack(groups.places[k]);
        if (group.place.has(s, lane)) packets.particle_ask(group.place.particle(s, lane), group.coming);
    }

    // Takes those that have come, and keeps them.
    __device__ __forceinline__ void take_group(const Solver& s, const GroupPlace& place, const vec3& theirs, const vec3& velocity) {
        bool is_there = place.has(s, lane);
        uint number = place.particle(s, lane);
        vec3 seen = theirs - middle;
        uint inside = __ballot_sync(ALL_LANES, is_there && is_in_reach(seen));
        uint slot = kept + __popc(inside & ((1u << lane) - 1)), entry = AREA_IN_PACKETS;
        kept += __popc(inside);
        if (slot < AREA_FAR_KEPT && inside >> lane & 1) {
            entry = AREA_ENTRIES + part * AREA_FAR_KEPT + slot;
            area_x()[entry] = with_w(theirs, 0);
            area_v()[entry] = with_w(velocity, 0);
        }
        take(members_first(), inside, seen, number << 16 | entry);
    }

    // Compares with what there is.
    __device__ __forceinline__ void compare() {
        members_end(members_first());
        find(members_first(), members_first() + count, 0, area_partners() + AREA_PARTNERS_HERE * TILE_PARTICLES, AREA_PARTNERS_FAR);
        __syncwarp();
        count = 0;
    }

    // Waits until it is known which groups are near; the particles of the first two are on their way then. Says whether there are any to search in.
    __device__ __forceinline__ bool begin(const Solver& s, const AreaPackets& packets, const FarGroups& groups, uint searches_before) {
        gate_wait(&groups.gate, searches_before);
        if (groups.count == 0 || groups.count > AREA_FAR_GROUPS) return false;
        ask(s, packets, groups, 0, even);
        ask(s, packets, groups, 1, odd);
        return true;
    }

    // Searches in the groups that are near.
    __device__ __forceinline__ void search(const Solver& s, const AreaPackets& packets, const FarGroups& groups) {
        middle = groups.middle;
        half = groups.half;
        count = kept = found = 0;
        see(s);
#pragma unroll 1
        for (uint k = 0; k < groups.count; k++) {
            // There is always room for a group.
            if (count > AREA_FAR_MEMBERS - AREA_AT_ONCE - GROUP) compare();
            GroupPlace place;
            vec3 theirs = {0, 0, 0}, velocity = {0, 0, 0};
            auto receive = [&](FarGroup& group) {
                place = group.place;
                if (place.has(s, lane)) packets.particle_wait(place.particle(s, lane), group.coming, theirs, velocity);
                ask(s, packets, groups, k + 2, group);
            };
            if (k % 2 == 0) {
                receive(even);
            } else {
                receive(odd);
            }
            take_group(s, place, theirs, velocity);
        }
        if (count > 0) compare();
    }
};
