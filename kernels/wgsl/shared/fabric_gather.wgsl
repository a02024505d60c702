// The sums of what triangles of fabric put at a particle.

// Where the rows of each particle start and end: n + 1 numbers for triangles, n + 1 for folds; then the rows, ascending: places in `fabric_vectors`.
@group(0) @binding(63) var<storage, read> fabric_rows: array<u32>;
@group(0) @binding(64) var<storage, read> fabric_vectors: array<vec4f>;

fn fabric_sum(start: vec3f, row: u32) -> vec3f {
    var sum = start;
    let end = fabric_rows[row + 1u];
    for (var at = fabric_rows[row]; at < end; at += 1u) {
        sum += fabric_vectors[fabric_rows[at]].xyz;
    }
    return sum;
}

fn membrane_force(particle: u32) -> vec3f {
    return fabric_sum(vec3f(0.0), particle);
}

fn bending_force(particle: u32) -> vec3f {
    return fabric_sum(vec3f(0.0), model.particle_count + 1u + particle);
}
