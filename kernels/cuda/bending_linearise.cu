// NUMERICS section 12, `bending_linearise`: the tangent of every patch, after the first part of `bending_forces`.

// Patches of a block, each with a warp for each of its three numbers.
#define PATCHES 32
// An odd stride, so that the same parts of several tangents do not share banks.
#define STAGED (BENDING_TANGENT + 1)

extern "C" __global__ void __launch_bounds__(3 * PATCHES) bending_linearise(const __grid_constant__ Solver s, const __grid_constant__ Linear l) {
    __shared__ real staged[PATCHES * STAGED];
    uint patch = threadIdx.x % PATCHES, row = threadIdx.x / PATCHES, first = blockIdx.x * PATCHES, number = first + patch;
    if (number < s.element_count) {
        Plate plate = plate_of(s, number);
        real weight = root(l.length * l.length + l.length * plate.damping());
        vec3 sums[PATCH_VERTICES] = {};
#pragma unroll
        for (uint k = 0; k < PATCH_FOLDS; k++) {
            vec3 gradient[4];
            uint fold = s.patch_folds[(size_t)k * s.element_count + number];
            fold_gradient(s, fold & ~TURNED, gradient);
            real share = weight * plate.map(row, k);
#pragma unroll
            for (uint vertex = 0; vertex < 4; vertex++) {
                vec3& sum = sums[fold_place(k, vertex)];
                sum = sum + (fold & TURNED ? gradient[vertex ^ 1] : gradient[vertex]) * share;
            }
        }
        real* own = staged + patch * STAGED;
#pragma unroll
        for (uint place = 0; place < PATCH_VERTICES; place++) {
#pragma unroll
            for (uint axis = 0; axis < 3; axis++) own[tangent_place(place, 3 * row + axis)] = component(sums[place], axis);
        }
        // The derivative by a vertex that comes again is the sum of all.
        const uint* particles = (const uint*)s.patches[number].particles;
        for (uint place = 0; place < PATCH_VERTICES; place++) {
            uint mark = particles[place];
            if (!(mark & COMES_AGAIN)) continue;
            for (uint part = 3 * row; part < 3 * row + 3; part++) {
                own[tangent_place(mark & ~COMES_AGAIN, part)] += own[tangent_place(place, part)];
                own[tangent_place(place, part)] = 0;
            }
        }
    }
    __syncthreads();
    uint count = BENDING_TANGENT * min((uint)PATCHES, s.element_count - first);
    real* to = l.bending_tangents + (size_t)first * BENDING_TANGENT;
    for (uint at = threadIdx.x; at < count; at += 3 * PATCHES) to[at] = staged[at / BENDING_TANGENT * STAGED + at % BENDING_TANGENT];
}
