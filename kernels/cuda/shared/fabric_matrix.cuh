// NUMERICS sections 11 and 12: the blocks that triangles of fabric add to the matrix, and its rows.

// Everything of which the blocks of a triangle consist: F; A psi_u'', A c, A psi_v'', A G and A S+ times what they are multiplied by in the
// matrix [kg m^2].
struct MembraneTangent {
    Gradient gradient;
    real stiffness[4];
    Plane stress;
};

// The derivatives of the three curvatures of a triangle by the vertices of its patch [1/m^2], and A D11, A D22, A D12 and 4 A D66 times what they are
// multiplied by in the matrix [kg m^4].
struct BendingTangent {
    vec3 gradients[PATCH_VERTICES][3];
    real plate[4];
    // An odd number of words: with 112 of them assembly takes 1.7 times as long, as the same parts of all tangents share banks.
    real unused;
};

struct ElementBlock {
    real entries[3][3];
};

// A symmetric 2 x 2 matrix without its negative eigenvalues.
__device__ __forceinline__ Plane tensile_part(const Plane& s) {
    real half = (real)0.5;
    real mean = half * (s.uu + s.vv), apart = half * (s.uu - s.vv);
    real radius = root(apart * apart + s.uv * s.uv);
    real largest = mean + radius, least = mean - radius;
    if (least >= 0) return s;
    if (largest <= 0) return {0, 0, 0};
    real share = largest / (radius + radius);
    return {share * (apart + radius), share * (radius - apart), share * s.uv};
}

// `membrane_linearise` of one triangle; its impulses go where its forces are.
__device__ __forceinline__ void membrane_tangent_store(const Solver& s, const Linear& l, const Motion& motion, uint number, bool from_start) {
    MembraneTriangle t = s.membranes[number];
    const FabricLaw& law = s.fabric_laws[t.fabric];
    vec3 x[3], v[3];
    vectors_load(motion.x, t.particles, x);
    vectors_load(motion.v, t.particles, v);
    Gradient f = deformation(x, t), rates = deformation(v, t);
    FabricResponse response = fabric_response(law, green_strain(f));
    Plane rate = green_strain_rate(f, rates);
    Plane tensile = tensile_part(response.stress);
    Plane stress = {t.area * tensile.uu, t.area * tensile.vv, t.area * tensile.uv};
    real length = l.length, square = length * length, damped = length * law.damping;
    Plane elastic = {length * response.stress.uu, length * response.stress.vv, length * response.stress.uv};
    Plane total = elastic + viscous_stress(law, response, rate, from_start ? square + damped : damped);
    vec3 impulses[3], turning[3];
    membrane_corners(f, total, t, t.area, impulses);
    if (from_start) membrane_corners(rates, stress, t, square, turning);
#pragma unroll
    for (uint k = 0; k < 3; k++) s.membrane_forces[3 * (size_t)number + k] = with_w(from_start ? impulses[k] + turning[k] : impulses[k], 0);
    real weight = square + damped;
    MembraneTangent& tangent = l.membrane_tangents[number];
    tangent.gradient = f;
    tangent.stiffness[0] = weight * (t.area * response.slope_u);
    tangent.stiffness[1] = weight * (t.area * law.coupling);
    tangent.stiffness[2] = weight * (t.area * response.slope_v);
    tangent.stiffness[3] = weight * (t.area * response.slope_shear);
    tangent.stress = {square * stress.uu, square * stress.vv, square * stress.uv};
}

// `bending_linearise` of one triangle.
__device__ __forceinline__ void bending_tangent_store(const Solver& s, const Linear& l, const Motion& motion, uint number, bool from_start) {
    const BendingPatch& patch = s.patches[number];
    Plate plate = plate_of(s, number);
    real length = l.length, damped = length * plate.damping();
    real along = from_start ? length * length + damped : damped;
    Fold folds[PATCH_FOLDS];
    Plane curvature = curvature_of(motion, patch, plate, length, along, true, folds);
    Plane m = plate.moment(curvature);
    vec3 forces[PATCH_VERTICES] = {};
#pragma unroll
    for (uint k = 0; k < PATCH_FOLDS; k++) fold_add(folds[k], k, -plate.fold_moment(k, m), forces);
#pragma unroll
    for (uint place = 0; place < PATCH_VERTICES; place++) s.bending_forces[PATCH_VERTICES * (size_t)number + place] = with_w(forces[place], 0);
    BendingTangent& tangent = l.bending_tangents[number];
    real weight = length * length + damped;
#pragma unroll
    for (uint k = 0; k < 4; k++) tangent.plate[k] = weight * plate.rigidity(k);
    // One curvature at a time, for the same reason.
#pragma unroll 1
    for (uint row = 0; row < 3; row++) {
        vec3 sums[PATCH_VERTICES] = {};
#pragma unroll
        for (uint k = 0; k < PATCH_FOLDS; k++) fold_add(folds[k], k, plate.map(row, k), sums);
#pragma unroll
        for (uint place = 0; place < PATCH_VERTICES; place++) tangent.gradients[place][row] = sums[place];
    }
}


__device__ __forceinline__ real2 corner_gradient(const MembraneTriangle& t, uint corner) {
    if (corner == 0) return {-(t.inverse[0] + t.inverse[2]), -(t.inverse[1] + t.inverse[3])};
    return {t.inverse[2 * corner - 2], t.inverse[2 * corner - 1]};
}

// Adds the block of corners a and b of a triangle.
__device__ __forceinline__ void membrane_block_add(const MembraneTriangle& t, const MembraneTangent& tangent, uint a, uint b, ElementBlock& block) {
    const Gradient& f = tangent.gradient;
    real2 at = corner_gradient(t, a), to = corner_gradient(t, b);
    const real* k = tangent.stiffness;
    const Plane& s = tangent.stress;
    vec3 shear_a = combination(f.u, at.y, f.v, at.x), shear_b = combination(f.u, to.y, f.v, to.x);
    vec3 along_u = combination(f.u, k[0] * to.x, f.v, k[1] * to.y), along_v = combination(f.u, k[1] * to.x, f.v, k[2] * to.y);
    real isotropic = at.x * (s.uu * to.x + s.uv * to.y) + at.y * (s.uv * to.x + s.vv * to.y);
#pragma unroll
    for (uint row = 0; row < 3; row++) {
        real pu = at.x * component(f.u, row), pv = at.y * component(f.v, row), ps = k[3] * component(shear_a, row);
#pragma unroll
        for (uint column = 0; column < 3; column++) {
            real sum = pu * component(along_u, column) + pv * component(along_v, column) + ps * component(shear_b, column);
            block.entries[row][column] += row == column ? sum + isotropic : sum;
        }
    }
}

// Adds the block of places a and b of a patch.
__device__ __forceinline__ void bending_block_add(const BendingTangent& tangent, uint a, uint b, ElementBlock& block) {
    const vec3* to = tangent.gradients[b];
    const real* plate = tangent.plate;
    vec3 moments[3] = {
        combination(to[0], plate[0], to[1], plate[2]),
        combination(to[0], plate[2], to[1], plate[1]),
        to[2] * plate[3],
    };
    ElementBlock sum = {};
#pragma unroll
    for (uint k = 0; k < 3; k++) {
        vec3 gradient = tangent.gradients[a][k];
#pragma unroll
        for (uint row = 0; row < 3; row++)
#pragma unroll
            for (uint column = 0; column < 3; column++) {
                sum.entries[row][column] = sum.entries[row][column] + component(moments[k], column) * component(gradient, row);
            }
    }
#pragma unroll
    for (uint row = 0; row < 3; row++)
#pragma unroll
        for (uint column = 0; column < 3; column++) block.entries[row][column] += sum.entries[row][column];
}

#define TERM_FOLDS 0x80000000u
#define TERM_PAIRS (PATCH_VERTICES * PATCH_VERTICES)

// A block by its number.
__device__ __forceinline__ ElementBlock element_block(const Solver& s, const Linear& l, uint number) {
    ElementBlock block = {};
    uint at = l.element_offsets[number], end = l.element_offsets[number + 1];
    for (; at < end; at++) {
        uint term = l.element_terms[at];
        if (term & TERM_FOLDS) break;
        uint pair = term % TERM_PAIRS, triangle = term / TERM_PAIRS;
        membrane_block_add(s.membranes[triangle], l.membrane_tangents[triangle], pair / PATCH_VERTICES, pair % PATCH_VERTICES, block);
    }
    for (; at < end; at++) {
        uint term = l.element_terms[at] & ~TERM_FOLDS, pair = term % TERM_PAIRS, triangle = term / TERM_PAIRS;
        bending_block_add(l.bending_tangents[triangle], pair / PATCH_VERTICES, pair % PATCH_VERTICES, block);
    }
    return block;
}

// The entry of row j whose column is i.
__device__ __forceinline__ uint element_find(const Linear& l, uint j, uint i) {
    uint first = l.element_slices[j / SLICE], last = l.element_slices[j / SLICE + 1];
    while (first < last) {
        uint middle = (first + last) / 2;
        // Empty places are behind all columns.
        if (l.element_columns[middle * SLICE + j % SLICE] < i) {
            first = middle + 1;
        } else {
            last = middle;
        }
    }
    return first;
}
