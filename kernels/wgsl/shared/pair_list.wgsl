// NUMERICS section 15: pairs of features, six words each: their particles, then their numbers, the first of these with EDGES if they are edges. Otherwise
// the first is a vertex and the second a triangle.

struct Pair {
    particles: vec4<u32>,
    first: u32,
    second: u32,
}

@group(0) @binding(73) var<storage, read_write> pairs: array<u32>;

const EDGES: u32 = 0x80000000u;
const PAIR_WORDS: u32 = 6u;

fn pair_get(number: u32) -> Pair {
    let at = PAIR_WORDS * number;
    let particles = vec4<u32>(pairs[at], pairs[at + 1u], pairs[at + 2u], pairs[at + 3u]);
    return Pair(particles, pairs[at + 4u], pairs[at + 5u]);
}

fn pair_set(number: u32, pair: Pair) {
    let at = PAIR_WORDS * number;
    pairs[at] = pair.particles.x;
    pairs[at + 1u] = pair.particles.y;
    pairs[at + 2u] = pair.particles.z;
    pairs[at + 3u] = pair.particles.w;
    pairs[at + 4u] = pair.first;
    pairs[at + 5u] = pair.second;
}

fn pair_is_edges(pair: Pair) -> bool {
    return (pair.first & EDGES) != 0u;
}
