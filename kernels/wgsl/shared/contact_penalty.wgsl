// NUMERICS section 8: the penalty force of one pair in contact.

fn penalty_add(sum: vec3f, position: vec3f, velocity: vec3f, partner: u32) -> vec3f {
    let pair = pair_of(position, position_in[partner].xyz);
    if pair.length_squared <= LENGTH_SQUARED_MIN {
        return sum;
    }
    let length = sqrt(pair.length_squared);
    let normal = pair.difference * (1.0 / length);
    let rate = dot_product(velocity - velocity_in[partner].xyz, normal);
    let overlap = model.contact_distance - length;
    let tension = fma(model.contact_stiffness, overlap, -(model.contact_damping * rate));
    return add_scaled(sum, tension, normal);
}
