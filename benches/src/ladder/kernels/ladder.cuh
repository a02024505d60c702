// What the rungs of the ladder share: the physics of one explicit substep with self-contact (NUMERICS sections 2, 3, 4, 7 and
// 8, penalty), one thread for each particle. A rung changes how constants and states are stored, and how contacts are found.

typedef unsigned int uint;

// Shortest length that is divided by [m], and the square below which a pair has no normal [m^2].
#define LENGTH_MIN 1e-18f
#define LENGTH_SQUARED_MIN 1e-14f

struct vec3 {
    float x, y, z;
};

__device__ __forceinline__ vec3 operator+(const vec3& a, const vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
__device__ __forceinline__ vec3 operator-(const vec3& a, const vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
__device__ __forceinline__ vec3 operator*(float s, const vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
__device__ __forceinline__ vec3 operator*(const vec3& a, float s) { return s * a; }
__device__ __forceinline__ float dot(const vec3& a, const vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
// The second number if the first is NaN.
__device__ __forceinline__ float maximum(float a, float b) { return a > b ? a : b; }

// Array of structs.
struct Particle {
    vec3 position;
    float mass;
    vec3 velocity;
    float inverse_mass;
};

// A spring of every particle, as columns and rows to its other end.
struct Neighbour {
    int across, up;
    float rest_length;
    float stiffness;
};

#define NEIGHBOURS 12

// As `workload.rs` lays it out.
struct Constants {
    uint side;
    uint count;
    float length;
    float damping;
    float gravity;
    float drag_rate;
    float contact_distance;
    float contact_stiffness;
    float contact_damping;
    float sphere_radius;
    vec3 sphere_centre;
    float sphere_friction;
    // Bins along x and y, a power of two, over the cloth again and again; layers along z; entries of a bin.
    uint bins_across;
    uint bin_layers;
    uint bin_capacity;
    float bins_per_metre;
    Neighbour neighbours[NEIGHBOURS];
};

// Force of a spring. `MATH` divides once instead of once for each axis.
template <bool MATH>
__device__ __forceinline__ vec3 spring_force(const Constants& c, const Neighbour& neighbour, const Particle& own, const Particle& other) {
    vec3 d = other.position - own.position;
    vec3 rate = other.velocity - own.velocity;
    float length = sqrtf(dot(d, d));
    float divisor = maximum(length, LENGTH_MIN);
    float stretch = length - neighbour.rest_length;
    if (MATH) {
        float inverse = 1.0f / divisor;
        float tension = neighbour.stiffness * stretch + c.damping * (dot(rate, d) * inverse);
        return (tension * inverse) * d;
    }
    vec3 n = {d.x / divisor, d.y / divisor, d.z / divisor};
    return (neighbour.stiffness * stretch + c.damping * dot(rate, n)) * n;
}

// Adds the force of a particle in contact. `MATH` compares squares, and takes roots of those in contact alone.
template <bool MATH>
__device__ __forceinline__ void contact_add(const Constants& c, const Particle& own, const Particle& other, vec3& sum) {
    vec3 d = own.position - other.position;
    float squared = dot(d, d);
    if (MATH) {
        if (!(squared < c.contact_distance * c.contact_distance && squared > LENGTH_SQUARED_MIN)) return;
    }
    float length = sqrtf(squared);
    vec3 n;
    if (MATH) {
        n = d * (1.0f / length);
    } else {
        if (!(length < c.contact_distance && length > sqrtf(LENGTH_SQUARED_MIN))) return;
        n = {d.x / length, d.y / length, d.z / length};
    }
    float scale = c.contact_stiffness * (c.contact_distance - length) - c.contact_damping * dot(own.velocity - other.velocity, n);
    sum = sum + scale * n;
}

// Contact with the sphere.
__device__ __forceinline__ void collide(const Constants& c, Particle& particle) {
    vec3 d = particle.position - c.sphere_centre;
    float length = sqrtf(dot(d, d));
    float depth = 0.5f * c.contact_distance - (length - c.sphere_radius);
    if (!(depth > 0)) return;
    vec3 n = (1.0f / maximum(length, LENGTH_MIN)) * d;
    particle.position = particle.position + depth * n;
    float approach = dot(particle.velocity, n);
    if (!(approach < 0)) return;
    vec3 along = particle.velocity - approach * n;
    float speed = maximum(sqrtf(dot(along, along)), LENGTH_MIN);
    particle.velocity = maximum(1.0f - c.sphere_friction * fabsf(approach) / speed, 0.0f) * along;
}

// One substep of particle i. `search(visit)` calls `visit` with every particle that may be in contact with it.
template <bool MATH, typename Search>
__device__ __forceinline__ Particle advance(const Constants& c, const Particle* particles, uint i, Search search) {
    Particle own = particles[i];
    vec3 v = own.velocity;
    vec3 force = {
        own.mass * (-(c.drag_rate * v.x)),
        own.mass * (-(c.drag_rate * v.y)),
        own.mass * (c.gravity - c.drag_rate * v.z),
    };
    int column = (int)(i % c.side), row = (int)(i / c.side), side = (int)c.side;
    for (uint k = 0; k < NEIGHBOURS; k++) {
        int x = column + c.neighbours[k].across, y = row + c.neighbours[k].up;
        if (x < 0 || x >= side || y < 0 || y >= side) continue;
        force = force + spring_force<MATH>(c, c.neighbours[k], own, particles[y * side + x]);
    }
    vec3 contact = {0, 0, 0};
    search([&](uint j) {
        if (j != i) contact_add<MATH>(c, own, particles[j], contact);
    });
    force = force + contact;
    own.velocity = v + (c.length * own.inverse_mass) * force;
    own.position = own.position + c.length * own.velocity;
    collide(c, own);
    return own;
}

// Contacts are looked for among all particles.
struct AllParticles {
    uint count;

    template <typename Visit>
    __device__ __forceinline__ void operator()(Visit visit) const {
        for (uint j = 0; j < count; j++) visit(j);
    }
};

template <bool MATH>
__device__ __forceinline__ void advance_all_pairs(const Constants& c, const Particle* from, Particle* to) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= c.count) return;
    to[i] = advance<MATH>(c, from, i, AllParticles{c.count});
}

// Bins: how many particles each should hold, and entry k of bin b at b times the capacity plus k. A place beyond the bins along an
// axis is one of those before it again, so that a bin may hold particles that are far from each other.
struct Bins {
    uint* counts;
    uint* entries;
    // The bin of each particle.
    uint* places;
    // The largest number of particles that a bin had no room for.
    uint* overflow;
};

__device__ __forceinline__ uint bin_along(const Constants& c, float x, uint bins) {
    return (uint)(int)floor(x * c.bins_per_metre) & (bins - 1);
}

__device__ __forceinline__ uint bin_at(const Constants& c, uint x, uint y, uint z) {
    return ((z & (c.bin_layers - 1)) * c.bins_across + (y & (c.bins_across - 1))) * c.bins_across + (x & (c.bins_across - 1));
}

// Calls `visit` with the bin and the 26 around it.
template <typename Visit>
__device__ __forceinline__ void bins_around(const Constants& c, uint bin, Visit visit) {
    uint x = bin & (c.bins_across - 1), y = bin / c.bins_across & (c.bins_across - 1), z = bin / (c.bins_across * c.bins_across);
    for (int dz = -1; dz <= 1; dz++) {
        for (int dy = -1; dy <= 1; dy++) {
            for (int dx = -1; dx <= 1; dx++) visit(bin_at(c, x + dx, y + dy, z + dz));
        }
    }
}

// A bin that is being filled.
struct BinFill {
    uint bin;
    uint count;

    __device__ __forceinline__ void add(const Constants& c, const Bins& bins, uint particle) {
        if (count < c.bin_capacity) bins.entries[(size_t)bin * c.bin_capacity + count] = particle;
        count++;
    }

    __device__ __forceinline__ void end(const Constants& c, const Bins& bins) {
        bins.counts[bin] = min(count, c.bin_capacity);
        if (count > c.bin_capacity) atomicMax(bins.overflow, count);
    }
};
