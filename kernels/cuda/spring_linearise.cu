// NUMERICS section 5, `spring_linearise`: the factors of every spring, by its first particle.

extern "C" __global__ void spring_linearise(const __grid_constant__ Solver s, const __grid_constant__ Linear l) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    along_write(s, l, i);
    if (i >= s.count) return;
    const real4* x = s.position[s.present];
    real4 own = x[i];
    l.origin[i] = own;
    vec3 xi = xyz(own);
    real step = l.length;
    real square = step * step;
    SpringRow row = spring_row(s, i);
    for (uint k = 0; k < row.count; k++) {
        uint at = row.first + (k << row.shift);
        uint2 entry = s.spring_entries[at];
        if ((int)entry.x < 0) continue;
        uint j = i + entry.x;
        SpringKind kind = spring_kind(s, entry.y);
        vec3 d = xyz(x[j]) - xi;
        real length = root(dot(d, d));
        real inverse = (real)1 / maximum(length, LENGTH_MIN);
        real stretch = length - kind.rest_length;
        real tension = kind.tension(stretch);
        real slope = kind.slope(stretch);
        real e = square * tension * inverse;
        real along = square * slope + step * kind.damping;
        real scale = root(maximum(along - maximum(e, (real)0), (real)0)) * inverse;
        vec3 u = scale * d;
        factors_write(l, factor_place(s, l, l.links[at].y, i, j), scale, across_of(along, u));
    }
}
