// Everything of which the blocks of triangles of fabric consist, TANGENT_WORDS for each: f_u, f_v; A psi_u'', A c, A psi_v'', A G and A S+, times
// what they are multiplied by in the matrix [kg m^2]; then the derivatives of the curvatures k11, k22, k12 by each vertex of the patch [1/m^2], and
// what their stiffness is multiplied by [s^2].
@group(0) @binding(65) var<storage, read_write> fabric_tangents: array<f32>;

const TANGENT_WORDS: u32 = 122u;
const TANGENT_CURVATURES: u32 = 13u;
const TANGENT_WEIGHT: u32 = 121u;

fn tangent_set(at: u32, vector: vec3f) {
    fabric_tangents[at] = vector.x;
    fabric_tangents[at + 1u] = vector.y;
    fabric_tangents[at + 2u] = vector.z;
}
