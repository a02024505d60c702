// What the rungs of the ladder share: the physics of one explicit substep with self-contact (NUMERICS sections 2, 3, 4, 7 and
// 8, penalty), one thread for each particle. A rung changes how constants and states are stored, and how contacts are found.

// Array of structs.
struct Particle {
    vec3 position;
    real mass;
    vec3 velocity;
    real inverse_mass;
};

// A spring of every particle, as columns and rows to its other end.
struct Neighbour {
    int across, up;
    real rest_length;
    real stiffness;
};

#define NEIGHBOURS 12

// As `ladder/workload.rs` of the backend lays it out.
struct Constants {
    uint side;
    uint count;
    real length;
    real damping;
    real gravity;
    real drag_rate;
    real contact_distance;
    real contact_stiffness;
    real contact_damping;
    real sphere_radius;
    vec3 sphere_centre;
    real sphere_friction;
    // Bins along x and y, a power of two, over the cloth again and again; layers along z; entries of a bin.
    uint bins_across;
    uint bin_layers;
    uint bin_capacity;
    real bins_per_metre;
    Neighbour neighbours[NEIGHBOURS];
};

// Force of a spring. `MATH` divides once instead of once for each axis.
template <bool MATH>
__device__ __forceinline__ vec3 spring_force(const Constants& c, const Neighbour& neighbour, const Particle& own, const Particle& other) {
    vec3 d = other.position - own.position;
    vec3 rate = other.velocity - own.velocity;
    real length = root(dot(d, d));
    real divisor = maximum(length, LENGTH_MIN);
    real stretch = length - neighbour.rest_length;
    if (MATH) {
        real inverse = (real)1 / divisor;
        real tension = neighbour.stiffness * stretch + c.damping * (dot(rate, d) * inverse);
        return (tension * inverse) * d;
    }
    vec3 n = {d.x / divisor, d.y / divisor, d.z / divisor};
    return (neighbour.stiffness * stretch + c.damping * dot(rate, n)) * n;
}

// Adds the force of a particle in contact. `MATH` compares squares, and takes roots of those in contact alone.
template <bool MATH>
__device__ __forceinline__ void contact_add(const Constants& c, const Particle& own, const Particle& other, vec3& sum) {
    vec3 d = own.position - other.position;
    real squared = dot(d, d);
    if (MATH) {
        if (!(squared < c.contact_distance * c.contact_distance && squared > LENGTH_SQUARED_MIN)) return;
    }
    real length = root(squared);
    vec3 n;
    if (MATH) {
        n = d * ((real)1 / length);
    } else {
        if (!(length < c.contact_distance && length > root(LENGTH_SQUARED_MIN))) return;
        n = {d.x / length, d.y / length, d.z / length};
    }
    real scale = c.contact_stiffness * (c.contact_distance - length) - c.contact_damping * dot(own.velocity - other.velocity, n);
    sum = sum + scale * n;
}

// Contact with the sphere.
__device__ __forceinline__ void collide(const Constants& c, Particle& particle) {
    vec3 d = particle.position - c.sphere_centre;
    real length = root(dot(d, d));
    real depth = (real)0.5 * c.contact_distance - (length - c.sphere_radius);
    if (!(depth > 0)) return;
    vec3 n = ((real)1 / maximum(length, LENGTH_MIN)) * d;
    particle.position = particle.position + depth * n;
    real approach = dot(particle.velocity, n);
    if (!(approach < 0)) return;
    vec3 along = particle.velocity - approach * n;
    real speed = maximum(root(dot(along, along)), LENGTH_MIN);
    particle.velocity = maximum((real)1 - c.sphere_friction * absolute(approach) / speed, (real)0) * along;
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

__device__ __forceinline__ uint bin_along(const Constants& c, real x, uint bins) {
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
