// NUMERICS section 8: the penalty force on a particle, its partners in ascending order.

fn contact_force(particle: u32, position: vec3f, velocity: vec3f) -> vec3f {
    let row = contact_rows[particle];
    var sum = vec3f(0.0);
    var count = 0u;
    for (var at = row.x; at < row.x + row.y; at += 1u) {
        let partner = contact_entries[at];
        let pair = pair_of(position, position_in[partner].xyz);
        if is_in_contact(pair) {
            count += 1u;
            if pair.length_squared > LENGTH_SQUARED_MIN {
                let length = sqrt(pair.length_squared);
                let normal = pair.difference * (1.0 / length);
                let rate = dot_product(velocity - velocity_in[partner].xyz, normal);
                let overlap = model.contact_distance - length;
                let tension = fma(model.contact_stiffness, overlap, -(model.contact_damping * rate));
                sum = add_scaled(sum, tension, normal);
            }
        }
    }
    if (substep.flags & FLAG_COUNT_CONTACTS) != 0u {
        contact_counts[particle] = count;
    }
    return sum;
}
