// NUMERICS section 8: what pairs in contact do.
//
// The row of a particle has every partner in contact but those that a spring joins to it. Where joined pairs
// count (the penalty response) they come from the rows of the springs; both are ascending.

// Two particles, seen from the first.
struct Pair {
    vec3 difference;
    real length_squared;
};

__device__ __forceinline__ Pair pair_of(const vec3& xi, const vec3& xj) {
    Pair pair;
    pair.difference = xi - xj;
    pair.length_squared = dot(pair.difference, pair.difference);
    return pair;
}

__device__ __forceinline__ bool is_in_contact(const Solver& s, real length_squared) {
    return length_squared < s.contact_distance * s.contact_distance;
}

// Calls `visit` with every partner of particle i, ascending.
template <typename Visit>
__device__ __forceinline__ void partners_visit(const Solver& s, const Motion& motion, uint i, const vec3& xi, bool joined, Visit visit) {
    SpringRow row = {0, 0, 0};
    if (joined) row = spring_row(s, i);
    uint listed = s.candidate_counts[i];
    uint k = 0, l = 0;
    const uint none = 0xffffffffu;
    uint from_list = listed > 0 ? s.candidates[i] : none;
    uint from_row = row.count > 0 ? i + spring_entry(s, row, 0).x : none;
    while (from_list != none || from_row != none) {
        uint j;
        if (from_list < from_row) {
            j = from_list;
            l++;
            from_list = l < listed ? s.candidates[(size_t)l * s.count + i] : none;
        } else {
            j = from_row;
            k++;
            from_row = k < row.count ? i + spring_entry(s, row, k).x : none;
        }
        Pair pair = pair_of(xi, xyz(motion.x[j]));
        if (is_in_contact(s, pair.length_squared)) visit(j, pair);
    }
}

// Force of one pair in contact on the first particle, times `normal`'s length, and that normal.
__device__ __forceinline__ void penalty_add(const Solver& s, const Pair& pair, const vec3& velocity, vec3& sum) {
    if (!(pair.length_squared > LENGTH_SQUARED_MIN)) return;
    real length, inverse;
    length_of(pair.length_squared, length, inverse);
    vec3 n = pair.difference * inverse;
    real scale = s.contact_stiffness * (s.contact_distance - length) - s.contact_damping * dot(velocity, n);
    sum = sum + scale * n;
}

// Penalty force on a particle [N], its partners in ascending order. Says whether there is any.
__device__ __noinline__ bool penalty_force(const Solver& s, Motion motion, uint i, vec3 xi, vec3 vi, vec3& sum, uint& contacts) {
    sum = make_vec3(0, 0, 0);
    uint count = 0;
    partners_visit(s, motion, i, xi, true, [&](uint j, const Pair& pair) {
        count++;
        penalty_add(s, pair, vi - xyz(motion.v[j]), sum);
    });
    contacts = count;
    return count > 0;
}

// What the impulses of all its partners do to a particle with inverse mass `w` and `crowd` partners; the other ones have `crowds`.
__device__ __forceinline__ void impulses_apply(
    const Solver& s, const Motion& motion, uint i, real w, uint crowd, const uint* crowds, real recovery, Moved& moved
) {
    vec3 xi = moved.position, vi = moved.velocity;
    vec3 velocity = {0, 0, 0}, position = {0, 0, 0};
    real rebound = (real)1 + s.contact_restitution;
    partners_visit(s, motion, i, xi, false, [&](uint j, const Pair& pair) {
        real total = w + motion.x[j].w;
        if (!(pair.length_squared > LENGTH_SQUARED_MIN) || total == 0) return;
        real length = root(pair.length_squared);
        real inverse = (real)1 / length;
        vec3 n = pair.difference * inverse;
        vec3 relative = vi - xyz(motion.v[j]);
        real share = w / total / (real)max(crowd, crowds[j]);
        real approach = dot(relative, n);
        real overlap = recovery * (s.contact_distance - length);
        vec3 tangential = relative - approach * n;
        real speed = root(dot(tangential, tangential));
        real lost = s.contact_friction * (rebound * absolute(approach)) / maximum(speed, LENGTH_MIN);
        lost = minimum(lost, (real)1);
        if (approach < 0) {
            real along = rebound * approach;
            velocity = velocity - share * (along * n + lost * tangential);
        }
        real push = share * overlap;
        position = position + push * n;
    });
    moved.position = xi + position;
    moved.velocity = vi + velocity;
}
