// NUMERICS section 15, contact_linearise: contacts of triangles as part of the matrix, where particles are in many of them from the terms that
// `conjugate_gradient_contacts` has worked out.

// Four terms at a time, so that the device waits once for them; what lies beyond the row is read again and left out.
fn triangle_row(start: vec3f, particle: u32, vector: u32) -> vec3f {
    var sum = vec3f(0.0);
    let places = contact_places(particle) - (TABLE_HEAD + model.particle_count + 1u);
    for (var k = places.x; k < places.y; k += 4u) {
        let last = places.y - 1u;
        let a = contact_terms[k].xyz;
        let b = contact_terms[min(k + 1u, last)].xyz;
        let c = contact_terms[min(k + 2u, last)].xyz;
        let d = contact_terms[min(k + 3u, last)].xyz;
        sum += a;
        sum = select(sum, sum + b, k + 1u < places.y);
        sum = select(sum, sum + c, k + 2u < places.y);
        sum = select(sum, sum + d, k + 3u < places.y);
    }
    return start + sum;
}
