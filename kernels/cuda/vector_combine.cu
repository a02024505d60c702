// NUMERICS section 5, `vector_combine`: a scale of zero drops its vector, whatever it holds.

extern "C" __global__ void vector_combine(const __grid_constant__ Solver s, const __grid_constant__ Linear l, uint from, uint to, real from_scale, real to_scale, uint has_from) {
    uint i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= s.count) return;
    vec3 kept = {0, 0, 0};
    if (to_scale != 0) kept = to_scale * xyz(l.vectors[to][i]);
    if (has_from) {
        vec3 scaled = from_scale * xyz(l.vectors[from][i]);
        kept = to_scale == 0 ? scaled : scaled + kept;
    }
    l.vectors[to][i] = with_w(kept, 0);
}
