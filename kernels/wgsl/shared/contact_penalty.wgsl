// NUMERICS section 8: the penalty force of one pair in contact.

// What a partner does to a particle: a tension [N] along a normal.
struct Push {
    normal: vec3f,
    tension: f32,
}

fn push_of(position: vec3f, velocity: vec3f, partner: u32) -> Push {
    let pair = pair_of(position, position_in[partner].xyz);
    if pair.length_squared <= LENGTH_SQUARED_MIN {
        return Push(vec3f(0.0), 0.0);
    }
    let length = sqrt(pair.length_squared);
    let normal = pair.difference * (1.0 / length);
    let rate = dot_product(velocity - velocity_in[partner].xyz, normal);
    let overlap = model.contact_distance - length;
    return Push(normal, fma(model.contact_stiffness, overlap, -(model.contact_damping * rate)));
}

fn penalty_add(sum: vec3f, push: Push) -> vec3f {
    return add_scaled(sum, push.tension, push.normal);
}
