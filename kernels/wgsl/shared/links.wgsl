// NUMERICS section 5: the springs as blocks of the matrix.
//
// `link_rows` has the form of `spring_rows`. An entry is the offset to the other particle and the place of
// the spring in `factors`, less the particle; both of its particles share one place. In regular patches
// places are columns: neighbouring particles read neighbouring memory.

@group(0) @binding(34) var<storage, read> link_rows: array<vec2<u32>>;
@group(0) @binding(35) var<storage, read> link_entries: array<vec2<u32>>;
// u [kg^(1/2)], and e [kg].
@group(0) @binding(38) var<storage, read_write> factors: array<vec4f>;

struct LinkRow {
    first: u32,
    end: u32,
    stride: u32,
}

fn link_row(particle: u32) -> LinkRow {
    let packed = link_rows[particle];
    let first = packed.x;
    let shape = packed.y;
    let stride = 1u << (shape >> 24u);
    return LinkRow(first, first + (shape & 0xffffffu) * stride, stride);
}
