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
    uint iterations;
    uint converged;
    uint breakdown;
    uint changed;
    uint constrained;
    uint padding;
};

struct Linear {
    // u and e of every spring: slots of n, then springs of their own.
    real4* factors;
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
    uint slot_count;
    // Whether B has entries off its diagonal.
    uint is_full;
    uint has_constraints;
    uint has_pairs;
    // Whether the preconditioner has entries off its diagonal.
    uint has_blocks;
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

// Row i of A times a vector.
__device__ __forceinline__ vec3 matrix_row(const Solver& s, const Linear& l, const real4* p, uint i) {
    vec3 own = xyz(p[i]);
    vec3 on = xyz(l.base[0][i]);
    vec3 sum = {on.x * own.x, on.y * own.y, on.z * own.z};
    if (l.is_full) {
        vec3 off = xyz(l.base[1][i]);
        sum.x += off.x * own.y + off.y * own.z;
        sum.y += off.x * own.x + off.z * own.z;
        sum.z += off.y * own.x + off.z * own.y;
    }
    SpringRow row = spring_row(s, i);
#pragma unroll 4
    for (uint k = 0; k < row.count; k++) {
        uint2 link = l.links[row.first + (k << row.shift)];
        uint j = i + link.x;
        real4 factor = l.factors[factor_place(s, l, link.y, i, j)];
        real g = maximum(factor.w, (real)0);
        vec3 d = own - xyz(p[j]);
        real along = factor.x * d.x + factor.y * d.y + factor.z * d.z;
        sum.x += g * d.x + factor.x * along;
        sum.y += g * d.y + factor.y * along;
        sum.z += g * d.z + factor.z * along;
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

// Sums of products over blocks of 512 particles as the CPU does them: one sum for each of 16 lanes, over
// packets and axes in order, then the lanes in double precision.
#define SUM_BLOCK 512
#define SUM_LANES 16

struct SumMemory {
    real products[2][3 * SUM_BLOCK];
    real lanes[2][SUM_LANES];
    double values[2][SUM_BLOCK];
    double total[2];
};

// Puts the products of this thread's particle in place for sum `which`.
__device__ __forceinline__ void sum_put(SumMemory& memory, uint which, const vec3& a, const vec3& b) {
    uint t = threadIdx.x;
    memory.products[which][t] = a.x * b.x;
    memory.products[which][SUM_BLOCK + t] = a.y * b.y;
    memory.products[which][2 * SUM_BLOCK + t] = a.z * b.z;
}

// Sums the block; the results go to `out` of each sum. All threads of the block take part.
__device__ __forceinline__ void sum_block(SumMemory& memory, uint sums, double* first, double* second) {
    __syncthreads();
    uint which = threadIdx.x >> 5, lane = threadIdx.x & 31;
    if (which < sums) {
        if (lane < SUM_LANES) {
            real sum = 0;
#pragma unroll 8
            for (uint packet = 0; packet < SUM_BLOCK / SUM_LANES; packet++) {
                for (uint axis = 0; axis < 3; axis++) {
                    sum += memory.products[which][axis * SUM_BLOCK + packet * SUM_LANES + lane];
                }
            }
            memory.lanes[which][lane] = sum;
        }
        __syncwarp();
        if (lane == 0) {
            double total = 0;
            for (uint k = 0; k < SUM_LANES; k++) total += (double)memory.lanes[which][k];
            if (which == 0) *first = total;
            else *second = total;
        }
    }
    __syncthreads();
}

// Adds the sums of all blocks in order; every thread gets the result.
__device__ __forceinline__ void sum_total(SumMemory& memory, const double* first, const double* second, uint blocks, double& a, double& b) {
    uint t = threadIdx.x;
    double total = 0;
    for (uint start = 0; start < blocks; start += SUM_BLOCK) {
        uint used = min(blocks - start, (uint)SUM_BLOCK);
        __syncthreads();
        if (t < used) {
            memory.values[0][t] = first[start + t];
            memory.values[1][t] = second[start + t];
        }
        __syncthreads();
        if ((t & 31) == 0 && t < 64) {
#pragma unroll 8
            for (uint k = 0; k < used; k++) total += memory.values[t >> 5][k];
        }
    }
    if ((t & 31) == 0 && t < 64) memory.total[t >> 5] = total;
    __syncthreads();
    a = memory.total[0];
    b = memory.total[1];
    __syncthreads();
}
