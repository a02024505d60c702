// Everything of which the blocks of triangles of fabric consist, TANGENT_WORDS for each: f_u, f_v; A psi_u'', A c, A psi_v'', A G and A S+, times
// what they are multiplied by in the matrix [kg m^2]; then for each vertex of the patch its parts of the three vectors [kg^(1/2)] whose products with
// themselves its folds add to the matrix, those of a vertex that comes again with the first one.
@group(0) @binding(65) var<storage, read_write> fabric_tangents: array<f32>;

const TANGENT_WORDS: u32 = 121u;
const TANGENT_PATCH: u32 = 13u;

fn tangent_set(at: u32, vector: vec3f) {
    fabric_tangents[at] = vector.x;
    fabric_tangents[at + 1u] = vector.y;
    fabric_tangents[at + 2u] = vector.z;
}
