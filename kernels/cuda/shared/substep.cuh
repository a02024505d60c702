// One explicit substep of one particle, NUMERICS sections 2 to 4 and 7: forces, integration, and
// colliders if nothing comes between.

// v + h w f, then x + h v.
__device__ __forceinline__ Moved integrate(real length, real inverse_mass, const vec3& force, const vec3& x, const vec3& v) {
    real factor = length * inverse_mass;
    Moved moved;
    moved.velocity = v + factor * force;
    moved.position = x + length * moved.velocity;
    return moved;
}

// Springs of a particle that are loaded before the first is used.
#ifdef CLOTH_WIDE
#define UNROLL _Pragma("unroll 12")
#else
#define UNROLL _Pragma("unroll 4")
#endif

// A spring of a shared row, with the numbers of its kind.
struct __align__(16) TableEntry {
    uint offset;
    real rest_length;
    real stiffness;
    real damping;
};

template <bool PENALTY, bool EXTRAS>
__device__ __forceinline__ void spring_add(
    const Solver& s, const SpringKind& kind, const vec3& xi, const vec3& vi, const real4& xj, const real4& vj,
    vec3& force, vec3& contact, uint& contacts
) {
    Spring spring = spring_at(kind, xi, vi, xyz(xj), xyz(vj));
    force = force + spring.force();
    if (PENALTY) {
        if (is_in_contact(s, spring.length_squared)) {
            contacts++;
            if (spring.length_squared > LENGTH_SQUARED_MIN) {
                vec3 n = make_vec3(-spring.difference.x, -spring.difference.y, -spring.difference.z) * spring.inverse_length;
                real scale = s.contact_stiffness * (s.contact_distance - spring.length)
                    - s.contact_damping * dot(vi - xyz(vj), n);
                contact = contact + scale * n;
            }
        }
    }
}

// Neighbour k is at `at` plus its offset in `x` and `v`: those of all particles, or of a tile of a patch.
template <bool PENALTY, bool EXTRAS, bool TABLE>
__device__ __forceinline__ Moved particle_advance(
    const Solver& s, const TableEntry* table, const uint2* headers, const Motion& motion, const SubstepData& substep, const Collider* colliders,
    const real4* x, const real4* v, uint at, uint i, const real4& own, const real4& rate, uint& contacts
) {
    vec3 xi = xyz(own), vi = xyz(rate);
    vec3 force = field_force(s, rate.w, vi);
    if (EXTRAS) force = procedural_force(substep, i, xi, vi, rate.w, force);
    vec3 contact = {0, 0, 0};
    uint joined_contacts = 0;
    if (TABLE) {
        uint2 header = headers[s.spring_row[i]];
        const TableEntry* entry = table + header.x;
        uint count = header.y & 0xffffffu;
UNROLL
        for (uint k = 0; k < count; k++) {
            TableEntry e = entry[k];
            uint j = at + e.offset;
            SpringKind kind = {e.rest_length, e.stiffness, e.damping, nullptr};
            if (EXTRAS && s.can_buckle) {
                uint number = s.spring_entries[header.x + k].y;
                if (s.spring_kinds[number].w != 0) kind.buckling = s.spring_buckling + number;
            }
            spring_add<PENALTY, EXTRAS>(s, kind, xi, vi, x[j], v[j], force, contact, joined_contacts);
        }
    } else {
        SpringRow row = spring_row(s, i);
UNROLL
        for (uint k = 0; k < row.count; k++) {
            uint2 entry = spring_entry(s, row, k);
            uint j = at + entry.x;
            real4 numbers = s.spring_kinds[entry.y];
            SpringKind kind = {numbers.x, numbers.y, numbers.z, nullptr};
            if (EXTRAS && s.can_buckle && numbers.w != 0) kind.buckling = s.spring_buckling + entry.y;
            spring_add<PENALTY, EXTRAS>(s, kind, xi, vi, x[j], v[j], force, contact, joined_contacts);
        }
    }
    if (EXTRAS && s.has_air) force = force + air_force(s, motion, i, substep.wind);
    if (PENALTY) {
        contacts = joined_contacts;
        if (s.candidate_counts[i] > 0 && any_candidate_in_contact(s, motion, i, xi)) {
            // Both kinds of partners have to be summed in one order.
            penalty_force(s, motion, i, xi, vi, contact, contacts);
        }
        if (contacts > 0) force = force + contact;
    }
    Moved moved = integrate(substep.length, own.w, force, xi, vi);
    if (colliders != nullptr && own.w > 0) collide_all<EXTRAS>(s, colliders, i, own.w, moved);
    return moved;
}
