// NUMERICS section 5: the linear system of the implicit step.

// Contact with one collider.
struct Touch {
    vec3 normal;
    // Velocity along the normal [m/s].
    real speed;
    // Velocity of the collider [m/s].
    vec3 surface;
    real friction;
    // Friction as a drag along the surface [kg], if the contact slides.
    real drag;
    // 1 if friction holds the particle.
    real sticks;
    // Number of the collider.
    real collider;
};

#define TOUCHES_MAX 4

struct Constraint {
    Touch touches[TOUCHES_MAX];
};

// xx, yy, zz, xy, xz, yz.
struct Symmetric {
    vec3 on;
    vec3 off;
};

// What a solver of linear systems did.
struct Outcome {
    double residual;
    // Estimate of the error in the norm of the energy, relative to that of the start; not a number where there is none.
    double energy;
    uint iterations;
    uint converged;
    uint breakdown;
    uint changed;
    uint constrained;
    // Whether the preconditioner or the matrix has turned out to be indefinite.
    uint indefinite;
};

// What is kept of a spring of the matrix where its row does not say how stiff it is along itself.
struct __align__(2 * sizeof(real)) Factors {
    real root;
    real across;
};

// A spring of the matrix, g I + u u^T of NUMERICS section 5.
struct SpringBlock {
    vec3 u;
    real g;
};

struct MembraneTangent;
struct Schwarz;

struct Linear {
    // Of every spring, slots of n, then springs of their own: u is `root` times the difference of the origins of its ends. Where
    // `along` is null, g is kept as well: `Factors`.
    real* roots;
    // h^2 T' + h c [kg] of the entries of the spring rows, from which g follows, if many particles share each row.
    real* along;
    // Positions at which the factors were computed; w as that of positions.
    real4* origin;
    // Offset and slot of the entries of the spring rows.
    const uint2* links;
    // Diagonal and the rest of B, D and the preconditioner.
    real4* base[2];
    real4* diagonal[2];
    real4* inverse[2];
    // In the order of `LinearVector`.
    real4* vectors[7];
    // Contacts with colliders of each particle, how many, filter and target velocity.
    Constraint* constraints;
    uint* touch_counts;
    real4* filter[2];
    real4* target;
    // Pairs in contact: entry k of particle i at k n + i, how many.
    uint* pair_partners;
    real4* pair_factors;
    uint* pair_counts;
    Outcome* outcome;
    double* partials;
    // Fabric: what the blocks of triangles are made of; stiffness [N m] and damping [N m s] of each fold in the matrix, and its vector at its four
    // vertices [kg^(1/2)], whose product with itself it adds; the constant diagonal of the semi-implicit step; for each place of the blocks where its terms
    // begin, and the end, and these; blocks off the diagonal in slices of 32 rows: for each slice its first entry, and the end; the columns of an entry, ascending, NONE behind the last one of a row; and nine numbers of
    // each, SLICE apart.
    MembraneTangent* membrane_tangents;
    const real2* fold_stiffness;
    real4* fold_tangents;
    real4* element_sums;
    const uint* term_offsets;
    const uint* terms;
    const uint* element_slices;
    const uint* element_columns;
    real* element_blocks;
    // Contacts of triangles.
    ContactTable contacts;
    // The preconditioner of that name, or null.
    const Schwarz* schwarz;
    uint slot_count;
    // Whether B has entries off its diagonal.
    uint is_full;
    uint has_constraints;
    uint has_pairs;
    // Whether the preconditioner has entries off its diagonal.
    uint has_blocks;
    // Whether there are triangles of fabric.
    uint has_elements;
    // Whether triangles touch.
    uint has_contacts;
    real length;
    // rho of contacts.
    real pair_share;
};

static_assert(sizeof(Linear) == (sizeof(real) > 4 ? 392 : 384), "`linear/data.rs` of the backend has another layout");

#define SOLUTION 0
#define RIGHT_SIDE 1
#define RESIDUAL 2
#define PRECONDITIONED 3
#define IMAGE 4
#define DIRECTION 5
#define DIRECTION_IMAGE 6
#define OWN_SLOT 0x80000000u

__device__ __forceinline__ vec3 symmetric_apply(const vec3& on, const vec3& off, const vec3& v) {
    return {
        on.x * v.x + off.x * v.y + off.y * v.z,
        off.x * v.x + on.y * v.y + off.z * v.z,
        off.y * v.x + off.z * v.y + on.z * v.z,
    };
}

// Where the factors of a spring are.
__device__ __forceinline__ size_t factor_place(const Solver& s, const Linear& l, uint slot, uint i, uint j) {
    if (slot & OWN_SLOT) return (size_t)l.slot_count * s.count + (slot & ~OWN_SLOT);
    return (size_t)slot * s.count + min(i, j);
}

// The stiffness along the springs of an entry, which follows from its kind alone.
__device__ __forceinline__ void along_write(const Solver& s, const Linear& l, uint at) {
    if (l.along == nullptr || at >= s.entry_count) return;
    SpringKind kind = spring_kind(s, s.spring_entries[at].y);
    l.along[at] = l.length * l.length * kind.stiffness + l.length * kind.damping;
}

// What is left of the stiffness along a spring for the directions across it.
__device__ __forceinline__ real across_of(real along, const vec3& u) { return maximum(along - dot(u, u), (real)0); }

__device__ __forceinline__ void factors_write(const Linear& l, size_t place, real root, real across) {
    if (l.along == nullptr) {
        ((Factors*)l.roots)[place] = {root, across};
    } else {
        l.roots[place] = root;
    }
}

// The spring of entry `at` from the difference of the origins of its ends. `SHARED` says that there is `along`.
template <bool SHARED>
__device__ __forceinline__ SpringBlock spring_block(const Linear& l, uint at, size_t place, const vec3& difference) {
    if (SHARED) {
        vec3 u = l.roots[place] * difference;
        return {u, across_of(l.along[at], u)};
    }
    Factors factors = ((const Factors*)l.roots)[place];
    return {factors.root * difference, factors.across};
}

__device__ __forceinline__ SpringBlock spring_block(const Linear& l, uint at, size_t place, const vec3& difference) {
    return l.along != nullptr ? spring_block<true>(l, at, place, difference) : spring_block<false>(l, at, place, difference);
}

// B times the vector of a particle.
__device__ __forceinline__ vec3 base_apply(const vec3& on, const vec3& off, bool is_full, const vec3& own) {
    vec3 sum = {on.x * own.x, on.y * own.y, on.z * own.z};
    if (is_full) {
        sum.x += off.x * own.y + off.y * own.z;
        sum.y += off.x * own.x + off.z * own.z;
        sum.z += off.y * own.x + off.z * own.y;
    }
    return sum;
}

// What a spring gives to a row, from the difference of the vectors of its ends.
__device__ __forceinline__ vec3 spring_term(const SpringBlock& spring, const vec3& d) {
    const vec3& u = spring.u;
    real along = u.x * d.x + u.y * d.y + u.z * d.z;
    return {spring.g * d.x + u.x * along, spring.g * d.y + u.y * along, spring.g * d.z + u.z * along};
}

__device__ __forceinline__ void spring_add(vec3& sum, const SpringBlock& spring, const vec3& d) { sum = sum + spring_term(spring, d); }

template <bool SHARED, uint MEMBERS>
__device__ __forceinline__ void springs_add(const Solver& s, const Linear& l, const real4* p, uint i, const vec3& origin, const vec3& own, vec3& sum) {
    SpringRow row = spring_row(s, i);
    terms_add<MEMBERS>(sum, 0, row.count, [&](uint k, vec3& term) {
        uint at = row.first + (k << row.shift);
        uint2 link = l.links[at];
        uint j = i + link.x;
        vec3 difference = xyz(l.origin[j]) - origin;
        term = spring_term(spring_block<SHARED>(l, at, factor_place(s, l, link.y, i, j), difference), own - xyz(p[j]));
        return true;
    });
}

// Adds what the pairs in contact give to row i, for a vector whose entries `value` gives.
template <uint MEMBERS, typename Value>
__device__ __forceinline__ void pairs_add(const Solver& s, const Linear& l, uint i, const vec3& own, Value value, vec3& sum) {
    terms_add<MEMBERS>(sum, 0, l.pair_counts[i], [&](uint k, vec3& term) {
        vec3 u = xyz(l.pair_factors[(size_t)k * s.count + i]);
        real along = dot(u, own - xyz(value(l.pair_partners[(size_t)k * s.count + i])));
        term = u * along;
        return true;
    });
}

#define SLICE 32

// Where the numbers of an entry of a row begin, SLICE apart: the entries of the rows of a slice lie side by side.
__device__ __forceinline__ size_t element_place(uint entry, uint i) { return (size_t)entry * 9 * SLICE + i % SLICE; }

// Row i of the blocks of triangles times a vector: each block takes the difference from that of the row, which stands for the diagonal block.
template <uint MEMBERS> __device__ __forceinline__ vec3 element_row(const Linear& l, const real4* p, uint i, const vec3& own) {
    vec3 sum = {0, 0, 0};
    terms_add<MEMBERS>(sum, l.element_slices[i / SLICE], l.element_slices[i / SLICE + 1], [&](uint entry, vec3& term) {
        uint j = l.element_columns[entry * SLICE + i % SLICE];
        bool exists = j != NONE;
        const real* block = l.element_blocks + element_place(entry, i);
        vec3 x = xyz(p[exists ? j : i]) - own;
        term.x = block[0] * x.x + block[SLICE] * x.y + block[2 * SLICE] * x.z;
        term.y = block[3 * SLICE] * x.x + block[4 * SLICE] * x.y + block[5 * SLICE] * x.z;
        term.z = block[6 * SLICE] * x.x + block[7 * SLICE] * x.y + block[8 * SLICE] * x.z;
        return exists;
    });
    return sum;
}

// Row i of A times a vector, for a particle with this origin. With several MEMBERS, all lanes of a warp call it, those of a team for one row. HAS_TERMS says that
// `contact_terms` of this vector are there, if the table has room for them.
template <uint MEMBERS, bool HAS_TERMS> __device__ __forceinline__ vec3 matrix_row(const Solver& s, const Linear& l, const real4* p, uint i, const real4& origin) {
    vec3 own = xyz(p[i]), off = {0, 0, 0};
    if (l.is_full) off = xyz(l.base[1][i]);
    vec3 sum = base_apply(xyz(l.base[0][i]), off, l.is_full, own);
    if (l.along != nullptr) {
        springs_add<true, MEMBERS>(s, l, p, i, xyz(origin), own, sum);
    } else {
        springs_add<false, MEMBERS>(s, l, p, i, xyz(origin), own, sum);
    }
    if (l.has_pairs) pairs_add<MEMBERS>(s, l, i, own, [&](uint j) { return p[j]; }, sum);
    if (l.has_contacts) {
        vec3 touching;
        if (HAS_TERMS && l.contacts.terms != nullptr) {
            touching = contacts_row_of_terms<MEMBERS>(l.contacts, i);
        } else {
            touching = contacts_row<MEMBERS>(l.contacts, p, i);
        }
        if (contacts_any(l.contacts, i)) sum = sum + touching;
    }
    if (l.has_elements) sum = sum + element_row<MEMBERS>(l, p, i, own);
    return sum;
}

// S y for a particle that is held or free.
__device__ __forceinline__ vec3 filtered(const Linear& l, uint i, bool is_free, const vec3& y) {
    if (!is_free) return {0, 0, 0};
    if (l.has_constraints && l.touch_counts[i] > 0) return symmetric_apply(xyz(l.filter[0][i]), xyz(l.filter[1][i]), y);
    return y;
}

// S y.
__device__ __forceinline__ vec3 filtered(const Solver& s, const Linear& l, uint i, const vec3& y) {
    return filtered(l, i, s.position[s.present][i].w > 0, y);
}

// S y + z.
__device__ __forceinline__ vec3 projected(const Solver& s, const Linear& l, uint i, const vec3& y) {
    if (!(s.position[s.present][i].w > 0)) return {0, 0, 0};
    if (!(l.has_constraints && l.touch_counts[i] > 0)) return y;
    vec3 on = xyz(l.filter[0][i]), off = xyz(l.filter[1][i]);
    vec3 change = xyz(l.target[i]) - xyz(s.velocity[s.present][i]);
    vec3 free = symmetric_apply(on, off, y);
    return free + (change - symmetric_apply(on, off, change));
}

// P^-1 y, before any filter.
__device__ __forceinline__ vec3 preconditioned(const Linear& l, uint i, const vec3& y) {
    vec3 on = xyz(l.inverse[0][i]);
    if (l.has_blocks) return symmetric_apply(on, xyz(l.inverse[1][i]), y);
    // Constrained particles have their block diagonal here too.
    return {on.x * y.x, on.y * y.y, on.z * y.z};
}
