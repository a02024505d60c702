// Two particles in contact.

// Pairs closer than this square [m^2] have no normal.
const LENGTH_SQUARED_MIN: f32 = 1e-14;

struct Pair {
    // From the partner to the particle [m].
    difference: vec3f,
    length_squared: f32,
}

fn pair_of(position: vec3f, partner: vec3f) -> Pair {
    let difference = position - partner;
    return Pair(difference, dot_product(difference, difference));
}

fn is_in_contact(pair: Pair) -> bool {
    return pair.length_squared < model.contact_distance * model.contact_distance;
}
