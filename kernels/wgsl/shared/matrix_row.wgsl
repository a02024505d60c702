// NUMERICS section 5, matrix_apply: a row of A times a vector in memory.

fn row_vector(place: u32) -> vec3f {
    return vectors[place].xyz;
}

fn matrix_row(particle: u32, vector: u32) -> vec3f {
    let own = vector_get(vector, particle);
    let sum = matrix_springs(particle, vector * model.particle_count + particle, own);
    let touching = triangle_row(contact_row(sum, particle, vector, own), particle, vector);
    return element_row(touching, particle, vector, own);
}
