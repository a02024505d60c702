// NUMERICS section 15: the contacts of triangles and what they do, ascending by their names.
//
// Three words: where contacts begin, whether the right-hand side has the velocities at the start, and how many contacts there are. For each particle where its places begin, and the end;
// the places, 4 c + a for particle a of contact c; for each contact its particles, their weights, where nodes of bodies are another particle with weight 0,
// S (xx, yy, zz, xy, xz, yz), the force on its first point, S sum w_b v_b of the nodes of bodies, and for each of its particles
// which of all places is that of this contact there.

@group(0) @binding(75) var<storage, read> contact_table: array<u32>;

const TABLE_HEAD: u32 = 3u;
const CONTACT_WORDS: u32 = 24u;
const RANKS: u32 = 20u;

fn contact_number(at: u32) -> f32 {
    return bitcast<f32>(contact_table[at]);
}

fn contact_three(at: u32) -> vec3f {
    return vec3f(contact_number(at), contact_number(at + 1u), contact_number(at + 2u));
}

// The range of the places of a particle.
fn contact_places(particle: u32) -> vec2<u32> {
    return vec2<u32>(contact_table[TABLE_HEAD + particle], contact_table[TABLE_HEAD + particle + 1u]);
}

// Where the contact of a place begins.
fn contact_of(place: u32) -> u32 {
    return contact_table[0] + CONTACT_WORDS * (place / 4u);
}

fn contact_weight(at: u32, place: u32) -> f32 {
    return contact_number(at + 4u + place % 4u);
}
