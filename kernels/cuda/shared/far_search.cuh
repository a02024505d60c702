// How another warp searches for the partners of the group in groups from elsewhere that are near.

// What the warp that searches in the area tells the one that searches in other groups: which of these are near, and where it looks.
struct FarGroups {
    vec3 middle;
    vec3 half;
    // The search that this is of (`search_turn`), written last.
    uint turn;
    // As many as there are, also those that there is no room for.
    uint count;
    unsigned short groups[AREA_FAR_GROUPS];

    // The groups of the list that are near, in the search of a number; all lanes of a warp.
    __device__ __forceinline__ void fill(const Solver& s, const AreaView& view, const AreaPackets& packets, uint listed, uint other, Coming& coming, uint number) {
        uint found = 0;
#pragma unroll 1
        for (uint first = 0; first < listed; first += 32) {
            if (first > 0) {
                other = view.listed_group(s, first, listed);
                if (other != NONE) coming.ask(packets.boxes + 2 * other, packets.boxes + 2 * other + 1);
            }
            uint near = view.near_groups(packets, other, coming), place = found + __popc(near & ((1u << view.lane) - 1));
            if (near >> view.lane & 1 && place < AREA_FAR_GROUPS) groups[place] = (unsigned short)other;
            found += __popc(near);
        }
        __syncwarp();
        if (view.lane > 0) return;
        middle = view.middle;
        half = view.half;
        count = found;
        note_write(&turn, number);
    }
};

struct FarSearch : AreaView {
    // How many particles are kept.
    uint kept;
    // The first group that is near, and its particles on their way.
    GroupPlace next;
    Coming coming;

    __device__ __forceinline__ FarSearch(const Solver& s, const GroupPlace& tile, uint part, uint lane) : AreaView(s, tile, part, lane) {}

    __device__ __forceinline__ uint members_first() const { return (part + 1) * AREA_MEMBERS - AREA_FAR_MEMBERS; }

    // Asks for the particles of one of the groups that are near, one of a lane each.
    __device__ __forceinline__ GroupPlace ask(const Solver& s, const AreaPackets& packets, const FarGroups& groups, uint k, Coming& coming) const {
        GroupPlace place = GroupPlace::of(s, groups.groups[k]);
        if (place.has(s, lane)) packets.particle_ask(place.particle(s, lane), coming);
        return place;
    }

    // Takes those that have come, and keeps them.
    __device__ __forceinline__ void take_group(const Solver& s, const AreaPackets& packets, const GroupPlace& place, Coming& coming) {
        bool is_there = place.has(s, lane);
        uint number = place.particle(s, lane);
        vec3 theirs = {0, 0, 0}, velocity;
        if (is_there) packets.particle_wait(number, coming, theirs, velocity);
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
    __device__ __forceinline__ void compare(const Solver& s) {
        __syncwarp();
        find(s, members_first(), members_first() + count, 0, area_partners() + AREA_PARTNERS_HERE * TILE_PARTICLES, AREA_PARTNERS_FAR);
        __syncwarp();
        count = 0;
    }

    // Waits until it is known which groups are near; the particles of the first are on their way then. Says whether there are any to search in.
    __device__ __forceinline__ bool begin(const Solver& s, const AreaPackets& packets, const FarGroups& groups, uint turn) {
        note_wait(&groups.turn, turn);
        if (groups.count == 0 || groups.count > AREA_FAR_GROUPS) return false;
        next = ask(s, packets, groups, 0, coming);
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
            if (count > AREA_FAR_MEMBERS - AREA_AT_ONCE - GROUP) compare(s);
            take_group(s, packets, next, coming);
            if (k + 1 < groups.count) next = ask(s, packets, groups, k + 1, coming);
        }
        if (count > 0) compare(s);
    }
};
