// NUMERICS section 12, `bending_linearise`: what each fold adds to the matrix, after the other parts of `bending_forces`.

extern "C" __global__ void bending_linearise(const __grid_constant__ Solver s, const __grid_constant__ Linear l) {
    uint number = blockIdx.x * blockDim.x + threadIdx.x;
    if (number >= s.fold_count) return;
    real2 stiffness = l.fold_stiffness[number];
    real weight = root((l.length * l.length) * stiffness.x + l.length * stiffness.y);
    vec3 gradient[4];
    fold_gradient(s, number, gradient);
#pragma unroll
    for (uint vertex = 0; vertex < 4; vertex++) l.fold_tangents[4 * (size_t)number + vertex] = with_w(weight * gradient[vertex], 0);
}
