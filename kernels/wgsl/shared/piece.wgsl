// NUMERICS section 6: pieces of cloth that nothing holds.

// The rotation that is taken out of a piece.
struct Turn {
    // A place in the piece, and its centre of mass seen from there [m]: far from the origin of space no
    // digits are lost.
    origin: vec3f,
    padding_0: f32,
    centre: vec3f,
    padding_1: f32,
    // [m/s / m]
    rate: vec3f,
    padding_2: f32,
}

// For each piece its first block and the end of its blocks; for each block its piece, first entry and end
// of the entries in `piece_particles`.
@group(0) @binding(48) var<storage, read> piece_rows: array<vec2<u32>>;
@group(0) @binding(49) var<storage, read> piece_blocks: array<vec4<u32>>;
@group(0) @binding(50) var<storage, read> piece_particles: array<u32>;
// Sums of each block, PIECE_WORDS each, with d from the first particle of the piece and p = m y - h f:
// m d and m; m d_x^2, m d_y^2, m d_z^2 and p_x; m d_x d_y, m d_y d_z, m d_z d_x and p_y; d x p and p_z.
@group(0) @binding(51) var<storage, read_write> piece_partials: array<vec4f>;
@group(0) @binding(52) var<storage, read_write> piece_turns: array<Turn>;

const PIECE_WORDS: u32 = 8u;
