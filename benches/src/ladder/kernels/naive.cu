// First rung: constants in device memory, a root and three divisions for every pair of particles. The new state is copied back.

extern "C" __global__ void step(const Constants* c, const Particle* from, Particle* to) {
    advance_all_pairs<false>(*c, from, to);
}
