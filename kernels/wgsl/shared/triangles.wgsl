// The triangles around each particle: n + 1 offsets, then the rows. A triangle is its three corners
// and the number of its cloth.

@group(0) @binding(10) var<storage, read> triangle_rows: array<u32>;
@group(0) @binding(11) var<storage, read> triangles: array<vec4<u32>>;
