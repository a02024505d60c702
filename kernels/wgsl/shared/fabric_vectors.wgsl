// What a triangle of fabric puts at its three corners, for all triangles, then what it puts at the vertices of its patch: forces [N], or
// impulses of an implicit step [N s]; three numbers each.

@group(0) @binding(64) var<storage, read_write> fabric_vectors: array<f32>;

fn fabric_vector_set(place: u32, vector: vec3f) {
    fabric_vectors[3u * place] = vector.x;
    fabric_vectors[3u * place + 1u] = vector.y;
    fabric_vectors[3u * place + 2u] = vector.z;
}
