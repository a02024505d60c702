// NUMERICS sections 11 and 12: the blocks that triangles of fabric add to the matrix, and its rows.

// Everything of which the blocks of a triangle consist: F; A psi_u'', A c, A psi_v'', A G and A S+ times what they are multiplied by in the
// matrix [kg m^2].
struct MembraneTangent {
    Gradient gradient;
    real stiffness[4];
    Plane stress;
};

// A term of a block: the mark of a fold, its number or that of a triangle, and the places there of the particles of row and column, of two bits each.
#define OF_FOLD 0x80000000u
#define TERM_SHIFT 4

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

__device__ __forceinline__ real2 corner_gradient(const MembraneTriangle& t, uint corner) {
    if (corner == 0) return {-(t.inverse[0] + t.inverse[2]), -(t.inverse[1] + t.inverse[3])};
    return {t.inverse[2 * corner - 2], t.inverse[2 * corner - 1]};
}

// The block of corners a and b of a triangle.
__device__ __forceinline__ ElementBlock membrane_block(const MembraneTriangle& t, const MembraneTangent& tangent, uint a, uint b) {
    ElementBlock block;
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
            block.entries[row][column] = row == column ? sum + isotropic : sum;
        }
    }
    return block;
}
