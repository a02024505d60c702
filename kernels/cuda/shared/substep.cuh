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

// A tile of a patch and two particles around it.
#define TILE_COLUMNS 32
#define TILE_ROWS 8
#define HALO 2
#define TILE_WIDTH (TILE_COLUMNS + 2 * HALO)
#define TILE_HEIGHT (TILE_ROWS + 2 * HALO)
// Odd, so that the entries of a column are in different banks.
#define TILE_STRIDE (TILE_WIDTH + 1)
#define TILE_ENTRIES (TILE_STRIDE * TILE_HEIGHT)

// Springs of a particle that are loaded before the first is used.
#ifdef CLOTH_MANY_REGISTERS
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

// Partners that a thread keeps by itself.
#define PARTNERS_NEAR 24

// Puts a partner, its number last, among `count` ascending ones, as far as there is room.
__device__ __forceinline__ void partner_add(real4* partners, uint count, const real4& partner) {
    if (count >= PARTNERS_NEAR) return;
    uint k = count;
    while (k > 0 && number_unpack(partners[k - 1].w) > number_unpack(partner.w)) {
        partners[k] = partners[k - 1];
        k--;
    }
    partners[k] = partner;
}

// Penalty force on a particle of a tile from all its partners, also those that springs join to it, in ascending order.
__device__ __forceinline__ void penalty_force_in_tile(
    const Solver& s, const Motion& motion, const real4* partners, uint found, const vec3& xi, const vec3& vi, vec3& sum, uint& contacts
) {
    sum = make_vec3(0, 0, 0);
    contacts = found;
    real4 next = motion.v[number_unpack(partners[0].w)];
    for (uint k = 0; k < found; k++) {
        real4 rate = next;
        if (k + 1 < found) next = motion.v[number_unpack(partners[k + 1].w)];
        penalty_add(s, pair_of(xi, xyz(partners[k])), vi - xyz(rate), sum);
    }
}

// What comes after the springs. `found` partners are in contact with the particle: those of `partners`, or, if that is
// null, those of its row in memory, beside which springs may join it to others that are `close`.
template <bool PENALTY, bool EXTRAS>
__device__ __forceinline__ Moved particle_finish(
    const Solver& s, const Motion& motion, const SubstepData& substep, const Collider* colliders, uint i, const real4& own, const real4& rate,
    const real4* partners, uint found, bool close, vec3 force, real offset, uint& contacts
) {
    vec3 xi = xyz(own), vi = xyz(rate);
#ifdef CLOTH_FABRIC
    force = force + membrane_force(s, i);
    force = force + bending_force(s, i);
#endif
    if (EXTRAS && s.has_air) force = force + air_force(s, motion, i, substep);
    if (PENALTY && (found > 0 || partners == nullptr && close)) {
        vec3 contact;
        if (partners != nullptr) {
            penalty_force_in_tile(s, motion, partners, found, xi, vi, contact, contacts);
        } else {
            // Both kinds of partners have to be summed in one order.
            penalty_force(s, motion, i, xi, vi, contact, contacts);
        }
        if (contacts > 0) force = force + contact;
    }
    Moved moved = integrate(substep.length, own.w, force, xi, vi);
    if (colliders != nullptr && own.w > 0) collide_all<EXTRAS>(s, colliders, i, offset, own.w, xi, substep.length, moved);
    return moved;
}

// Neighbour k is at `at` plus its offset in `x` and `v`: those of all particles, or of a tile of a patch. Partners as above.
template <bool PENALTY, bool EXTRAS, bool TABLE>
__device__ __forceinline__ Moved particle_advance(
    const Solver& s, const TableEntry* table, const uint2* headers, const Motion& motion, const SubstepData& substep, const Collider* colliders,
    const real4* x, const real4* v, uint at, uint i, const real4& own, const real4& rate, const real4* partners, uint found, uint& contacts
) {
    vec3 xi = xyz(own), vi = xyz(rate);
    vec3 force = field_force(s, rate.w, vi);
    // Nothing without procedural fields.
    force = procedural_force(substep, i, xi, vi, rate.w, force);
    real closest = REAL_MAX;
    // Long before it is used.
    real offset = colliders != nullptr ? s.offsets[i] : 0;
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
                if (s.spring_kinds[number].w > 0) kind.buckling = s.spring_buckling + number;
            }
            Spring spring = spring_at(kind, xi, vi, xyz(x[j]), xyz(v[j]));
            force = force + spring.force();
            if (PENALTY) closest = minimum(spring.length_squared, closest);
        }
    } else {
        SpringRow row = spring_row(s, i);
UNROLL
        for (uint k = 0; k < row.count; k++) {
            uint2 entry = spring_entry(s, row, k);
            uint j = at + entry.x;
            real4 numbers = s.spring_kinds[entry.y];
            SpringKind kind = {numbers.x, numbers.y, numbers.z, nullptr};
            if (EXTRAS && s.can_buckle && numbers.w > 0) kind.buckling = s.spring_buckling + entry.y;
            Spring spring = spring_at(kind, xi, vi, xyz(x[j]), xyz(v[j]));
            force = force + spring.force();
            if (PENALTY) closest = minimum(spring.length_squared, closest);
        }
    }
    return particle_finish<PENALTY, EXTRAS>(s, motion, substep, colliders, i, own, rate, partners, found, is_in_contact(s, closest), force, offset, contacts);
}
