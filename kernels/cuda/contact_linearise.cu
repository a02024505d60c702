// NUMERICS section 5, `contact_linearise`: direction and weight of each pair in contact; section 15, where triangles have theirs.

extern "C" __global__ void contact_linearise(const __grid_constant__ Solver s, const __grid_constant__ Linear l, real weight) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    uint count = 0;
    partners_visit(s, present_motion(s), i, xyz(s.position[s.present][i]), true, [&](uint j, const Pair& pair) {
        if (!(pair.length_squared > LENGTH_SQUARED_MIN)) return;
        real inverse = (real)1 / root(pair.length_squared);
        l.pair_partners[(size_t)count * s.count + i] = j;
        l.pair_factors[(size_t)count * s.count + i] = with_w(weight * (pair.difference * inverse), 0);
        count++;
    });
    l.pair_counts[i] = count;
}

// Where the particles of each contact have their places.
extern "C" __global__ void contact_linearise_ranks(const __grid_constant__ Solver, const __grid_constant__ ContactTable table) {
    uint k = blockIdx.x * blockDim.x + threadIdx.x;
    if (k < table.place_count) table.ranks[table.places[k]] = k;
}
