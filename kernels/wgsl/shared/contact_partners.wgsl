// The candidates of each particle, ascending: first entry and number of entries.

@group(0) @binding(17) var<storage, read> contact_rows: array<vec2<u32>>;
@group(0) @binding(18) var<storage, read> contact_entries: array<u32>;
// Number of partners that each particle is in contact with.
@group(0) @binding(19) var<storage, read_write> contact_counts: array<u32>;

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
