// What a triangle of fabric puts at its three corners, for all triangles, then what each fold puts at its four vertices: forces [N]; in implicit steps
// impulses [N s].

@group(0) @binding(64) var<storage, read_write> fabric_vectors: array<vec4f>;

fn fabric_vector_set(place: u32, vector: vec3f) {
    fabric_vectors[place] = vec4f(vector, 0.0);
}
