// NUMERICS section 15: the triangles in groups of eight that lie close together at the start, with what belongs to them.
//
// Eight words for each: its number, NO_TRIANGLE at the end of the last groups; its corners; a bit for each corner and then for each edge that
// belongs to it; its edges. Behind all of them two words for each edge, its particles, and for each
// node whom seams make it one with.

@group(0) @binding(68) var<storage, read> surface: array<u32>;

const NO_TRIANGLE: u32 = 0xffffffffu;
// Triangles of a group, and words of a triangle.
const SLOTS: u32 = 8u;

fn triangle_word(slot: u32, word: u32) -> u32 {
    return surface[8u * slot + word];
}

fn triangle_corners(slot: u32) -> vec3<u32> {
    return vec3<u32>(triangle_word(slot, 1u), triangle_word(slot, 2u), triangle_word(slot, 3u));
}

fn edge_ends(edge: u32) -> vec2<u32> {
    let at = 8u * SLOTS * pair_task.group_count + 2u * edge;
    return vec2<u32>(surface[at], surface[at + 1u]);
}

fn seam_class(particle: u32) -> u32 {
    return surface[8u * SLOTS * pair_task.group_count + 2u * pair_task.edge_count + particle];
}
