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

// A sum and the stamp that says which one it is.
struct __align__(16) Sum {
    double value;
    ulong stamp;
};

// What a solver of linear systems did.
struct Outcome {
    double residual;
    uint iterations;
    uint converged;
    uint breakdown;
    uint changed;
    uint constrained;
    uint padding;
};

// A spring of the matrix: u is `root` times the difference of the origins of its ends.
struct __align__(2 * sizeof(real)) Factors {
    real root;
    // g of NUMERICS section 5.
    real across;
};

struct Linear {
    // Of every spring: slots of n, then springs of their own.
    Factors* factors;
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
    // What blocks tell each other in the middle of an iteration: vectors of all particles, and sums. Two of each in turn.
    real4* exchange[2];
    Sum* sums[2];
    uint slot_count;
    // Whether B has entries off its diagonal.
    uint is_full;
    uint has_constraints;
    uint has_pairs;
    // Whether the preconditioner has entries off its diagonal.
    uint has_blocks;
    // The largest distance of two neighbours by index.
    uint reach;
    // Stamps of what is exchanged in a solve are larger than this.
    uint stamp;
    uint padding;
    real length;
    // rho of contacts.
    real pair_share;
};

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

// Adds what a spring gives to a row, from the difference of the vectors of its ends.
__device__ __forceinline__ void spring_add(vec3& sum, const vec3& u, real g, const vec3& d) {
    real along = u.x * d.x + u.y * d.y + u.z * d.z;
    sum.x += g * d.x + u.x * along;
    sum.y += g * d.y + u.y * along;
    sum.z += g * d.z + u.z * along;
}

// Row i of A times a vector.
__device__ __forceinline__ vec3 matrix_row(const Solver& s, const Linear& l, const real4* p, uint i) {
    vec3 own = xyz(p[i]), origin = xyz(l.origin[i]), off = {0, 0, 0};
    if (l.is_full) off = xyz(l.base[1][i]);
    vec3 sum = base_apply(xyz(l.base[0][i]), off, l.is_full, own);
    SpringRow row = spring_row(s, i);
#pragma unroll 4
    for (uint k = 0; k < row.count; k++) {
        uint2 link = l.links[row.first + (k << row.shift)];
        uint j = i + link.x;
        Factors factors = l.factors[factor_place(s, l, link.y, i, j)];
        spring_add(sum, factors.root * (xyz(l.origin[j]) - origin), factors.across, own - xyz(p[j]));
    }
    if (l.has_pairs) {
        uint count = l.pair_counts[i];
        for (uint k = 0; k < count; k++) {
            vec3 u = xyz(l.pair_factors[(size_t)k * s.count + i]);
            real along = dot(u, own - xyz(p[l.pair_partners[(size_t)k * s.count + i]]));
            sum = sum + u * along;
        }
    }
    return sum;
}

// S y.
__device__ __forceinline__ vec3 filtered(const Solver& s, const Linear& l, uint i, const vec3& y) {
    if (!(s.position[s.present][i].w > 0)) return {0, 0, 0};
    if (l.has_constraints && l.touch_counts[i] > 0) return symmetric_apply(xyz(l.filter[0][i]), xyz(l.filter[1][i]), y);
    return y;
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
