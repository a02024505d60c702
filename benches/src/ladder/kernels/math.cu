// Third rung: squares of distances are compared before a root is taken, and one reciprocal takes the place of three divisions.
// The rung `swap` runs the same kernel, on two states that take turns.

extern "C" __global__ void step(const __grid_constant__ Constants c, const Particle* from, Particle* to) {
    advance_all_pairs<true>(c, from, to);
}
