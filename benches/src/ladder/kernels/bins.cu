// Fifth and sixth rung: contacts are looked for in the bin of a particle and the 26 around it. Bins are filled without atomic
// additions, one thread for each bin, so that the order in them is always the same.

// The bin of each particle.
extern "C" __global__ void bins_place(const __grid_constant__ Constants c, const __grid_constant__ Bins bins, const Particle* particles) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= c.count) return;
    vec3 x = particles[i].position;
    bins.places[i] = bin_at(c, bin_along(c, x.x, c.bins_across), bin_along(c, x.y, c.bins_across), bin_along(c, x.z, c.bin_layers));
}

// Fifth rung: every bin looks at all particles.
extern "C" __global__ void bins_fill(const __grid_constant__ Constants c, const __grid_constant__ Bins bins) {
    uint bin = blockIdx.x * blockDim.x + threadIdx.x;
    if (bin >= c.bins_across * c.bins_across * c.bin_layers) return;
    BinFill fill = {bin, 0};
    for (uint i = 0; i < c.count; i++) {
        if (bins.places[i] == bin) fill.add(c, bins, i);
    }
    fill.end(c, bins);
}

// Sixth rung: every bin looks at what was in the bins around it before, as no particle goes farther in one substep.
extern "C" __global__ void bins_refill(const __grid_constant__ Constants c, const __grid_constant__ Bins last, const __grid_constant__ Bins bins) {
    uint bin = blockIdx.x * blockDim.x + threadIdx.x;
    if (bin >= c.bins_across * c.bins_across * c.bin_layers) return;
    BinFill fill = {bin, 0};
    bins_around(c, bin, [&](uint other) {
        uint count = last.counts[other];
        for (uint k = 0; k < count; k++) {
            uint i = last.entries[(size_t)other * c.bin_capacity + k];
            if (bins.places[i] == bin) fill.add(c, bins, i);
        }
    });
    fill.end(c, bins);
}

// Contacts are looked for in the bins around a particle.
struct NearParticles {
    const Constants& c;
    const Bins& bins;
    uint place;

    template <typename Visit>
    __device__ __forceinline__ void operator()(Visit visit) const {
        bins_around(c, place, [&](uint bin) {
            uint count = bins.counts[bin];
            for (uint k = 0; k < count; k++) visit(bins.entries[(size_t)bin * c.bin_capacity + k]);
        });
    }
};

extern "C" __global__ void step(const __grid_constant__ Constants c, const __grid_constant__ Bins bins, const Particle* from, Particle* to) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= c.count) return;
    to[i] = advance<true>(c, from, i, NearParticles{c, bins, bins.places[i]});
}
