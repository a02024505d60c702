// NUMERICS section 10, `measure`: sums over blocks of 512 particles, within a block over those that have the same place in packets of 16,
// then over these places; the host adds the blocks in order.

#define BLOCK 512
#define LANES 16
// Numbers of a block: strain_max, strain_particle, strain_sum, ends, elastic, force 3, magnitude, momentum 3,
// kinetic, potential, penetration, non-finite particle or -1.
#define FIGURES 16
#define NO_ROW 0xffffffffu

// The sums over a block of `count` rows of numbers into `out`, of row `quarter` a fourth. Sixteen threads of a warp take a row.
template <typename Number>
__device__ __forceinline__ void rows_sum(const Number* rows, uint count, uint quarter, double* out) {
    uint row = threadIdx.x / 32, lane = threadIdx.x & 31;
    if (row >= count) return;
    double sum = 0, scale = row == quarter ? 0.25 : 1;
    if (lane < LANES) {
#pragma unroll 8
        for (uint packet = 0; packet < BLOCK / LANES; packet++) sum += scale * (double)rows[row * BLOCK + packet * LANES + lane];
    }
    double total = 0;
    for (uint k = 0; k < LANES; k++) total += __shfl_sync(0xffffffffu, sum, k);
    if (lane == 0) out[row] = total;
}

// The largest of a warp's values that are above -1, and the first place that it is at.
__device__ __forceinline__ void warp_largest(double& value, uint& place) {
    if (!(value > -1)) value = -1;
    for (uint width = 16; width > 0; width /= 2) {
        double other = __shfl_xor_sync(0xffffffffu, value, width);
        uint there = __shfl_xor_sync(0xffffffffu, place, width);
        if (other > value || other == value && there < place) {
            value = other;
            place = there;
        }
    }
}

// The same of a block, whose warps have put theirs side by side; in the first warp.
__device__ __forceinline__ void block_largest(const double* values, const uint* places, double& value, uint& place) {
    if (threadIdx.x >= 32) return;
    uint warp = threadIdx.x % (BLOCK / 32);
    value = values[warp];
    place = places[warp];
    warp_largest(value, place);
}

extern "C" __global__ void __launch_bounds__(512) measure(const __grid_constant__ Solver s, double ax, double ay, double az, uint collider_first) {
    __shared__ double values[5 * BLOCK];
    real* numbers = (real*)values;
    uint t = threadIdx.x;
    uint i = blockIdx.x * BLOCK + t;
    bool exists = i < s.count;
    Motion motion = present_motion(s);
    double* out = s.partials + (size_t)blockIdx.x * FIGURES;
    real4 x = {0, 0, 0, 0}, v = {0, 0, 0, 0};
    if (exists) {
        x = motion.x[i];
        v = motion.v[i];
    }
    real strain_max = -1, strain_sum = 0, elastic = 0, magnitude = 0, ends = 0;
    vec3 force = {0, 0, 0};
    if (exists) {
        SpringRow row = spring_row(s, i);
        for (uint k = 0; k < row.count; k++) {
            uint2 entry = spring_entry(s, row, k);
            uint j = i + entry.x;
            SpringKind kind = spring_kind(s, entry.y);
            Spring spring = spring_at(kind, xyz(x), xyz(v), xyz(motion.x[j]), xyz(motion.v[j]));
            real strain = spring.stretch / kind.rest_length;
            // The last number of a kind is zero if its strain is measured.
            if (s.spring_kinds[entry.y].w == 0) strain_max = maximum(strain, strain_max);
            strain_sum += absolute(strain);
            elastic += kind.energy_doubled(spring.stretch);
            magnitude += absolute(spring.tension);
            ends += 1;
            force = force + spring.force();
        }
    }
    // In two rounds, as shared memory holds five numbers of double precision a particle.
    numbers[t] = strain_sum;
    numbers[BLOCK + t] = ends;
    numbers[2 * BLOCK + t] = elastic;
    __shared__ double largest[BLOCK / 32];
    __shared__ uint places[BLOCK / 32];
    double value = exists ? (double)strain_max : -1;
    uint place = t;
    warp_largest(value, place);
    if ((t & 31) == 0) {
        largest[t / 32] = value;
        places[t / 32] = place;
    }
    __syncthreads();
    // Both ends of a spring count twice its energy.
    rows_sum(numbers, 3, 2, out + 2);
    block_largest(largest, places, value, place);
    if (t == 0) {
        out[0] = value;
        out[1] = (double)(value > -1 ? blockIdx.x * BLOCK + place : 0);
    }
    __syncthreads();
    numbers[t] = force.x;
    numbers[BLOCK + t] = force.y;
    numbers[2 * BLOCK + t] = force.z;
    numbers[3 * BLOCK + t] = magnitude;
    __syncthreads();
    rows_sum(numbers, 4, NO_ROW, out + 5);
    __syncthreads();
    double mass = v.w;
    double m[3] = {mass * (double)v.x, mass * (double)v.y, mass * (double)v.z};
    double p[3] = {x.x, x.y, x.z}, a[3] = {ax, ay, az}, w[3] = {v.x, v.y, v.z};
    double kinetic = 0, potential = 0;
    for (uint axis = 0; axis < 3; axis++) {
        kinetic += 0.5 * (mass * w[axis] * w[axis]);
        potential -= mass * (a[axis] * p[axis]);
        values[axis * BLOCK + t] = m[axis];
    }
    values[3 * BLOCK + t] = kinetic;
    values[4 * BLOCK + t] = potential;
    __syncthreads();
    rows_sum(values, 5, NO_ROW, out + 9);
    real deepest = 0;
    if (exists && x.w > 0) {
        real offset = s.offsets[i];
        for (uint k = 0; k < s.collider_count; k++) {
            const Collider& c = s.colliders[collider_first + k];
            deepest = maximum(offset - surface_of(c, xyz(x) - collider_translation(c)).distance, deepest);
        }
    }
    bool finite = is_finite(xyz(x)) && is_finite(xyz(v));
    value = deepest;
    place = t;
    warp_largest(value, place);
    __shared__ uint broken;
    if (t == 0) broken = BLOCK;
    __syncthreads();
    if ((t & 31) == 0) {
        largest[t / 32] = value;
        places[t / 32] = place;
    }
    if (exists && !finite) atomicMin(&broken, t);
    __syncthreads();
    block_largest(largest, places, value, place);
    if (t == 0) {
        out[14] = value > 0 ? value : 0;
        out[15] = broken < BLOCK ? (double)(blockIdx.x * BLOCK + broken) : -1;
    }
}

// Numbers of a block of triangles of fabric: largest strain, particle, sum of |strain|, energy.
#define FABRIC_FIGURES 4

// The same over blocks of 512 triangles: larger principal stretch less 1, and what the triangle has stored.
extern "C" __global__ void __launch_bounds__(512) measure_fabric(const __grid_constant__ Solver s, double* partials) {
    __shared__ double values[2 * BLOCK];
    __shared__ double largest[BLOCK / 32];
    __shared__ uint places[BLOCK / 32];
    uint t = threadIdx.x, number = blockIdx.x * BLOCK + t;
    double* out = partials + (size_t)blockIdx.x * FABRIC_FIGURES;
    double value = -1, energy = 0;
    if (number < s.element_count) {
        Motion motion = present_motion(s);
        MembraneTriangle triangle = s.membranes[number];
        vec3 corners[3];
        vectors_load(motion.x, triangle.particles, corners);
        Plane strain = green_strain(deformation(corners, triangle));
        real mean = (real)1 + (strain.uu + strain.vv);
        real apart = strain.uu - strain.vv, across = (real)2 * strain.uv;
        real radius = root(apart * apart + across * across);
        value = (double)root(maximum(mean + radius, (real)0)) - 1.0;
        double stored = (double)fabric_response(s.fabric_laws[triangle.fabric], strain).energy * (double)triangle.area;
        Plate plate = plate_of(s, number);
        Plane roots = energy_roots(s, number, plate, 1, 0);
        energy = stored + (double)((real)0.5 * (roots.uu * roots.uu + roots.vv * roots.vv + roots.uv * roots.uv));
    }
    values[t] = number < s.element_count ? fabs(value) : 0;
    values[BLOCK + t] = energy;
    uint place = t;
    warp_largest(value, place);
    if ((t & 31) == 0) {
        largest[t / 32] = value;
        places[t / 32] = place;
    }
    __syncthreads();
    rows_sum(values, 2, NO_ROW, out + 2);
    block_largest(largest, places, value, place);
    if (t == 0) {
        out[0] = value;
        out[1] = (double)(value > -1 ? s.membranes[blockIdx.x * BLOCK + place].particles[0] : 0);
    }
}
