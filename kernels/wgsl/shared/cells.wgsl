// Cells of space in a table of fixed size, each with a chain of the regions that touch it.

// Cells of a region that are put into the table.
const COVER_MAX: u32 = 27u;

// First entries of the chains, plus one; 0 for none. Two tables take turns: one is cleared while the other is in use.
@group(0) @binding(27) var<storage, read_write> cell_heads: array<atomic<u32>>;
// For each region and each of its cells the next one of the chain and the name of the cell.
@group(0) @binding(28) var<storage, read_write> cell_nodes: array<vec2<u32>>;
// For each group its region and the groups that may come near it (`group_row`).
@group(0) @binding(26) var<storage, read_write> group_rows: array<vec4<u32>>;

// The cells that a region touches, with the contact distance around it.
struct Cover {
    low: vec3<i32>,
    size: vec3<u32>,
    // More than COVER_MAX is too many.
    count: u32,
}

fn cell_of(position: vec3f) -> vec3<i32> {
    let scaled = floor(position * contact.cells_per_metre);
    return vec3<i32>(clamp(scaled, vec3f(-1e9), vec3f(1e9)));
}

fn cover_of(region: Box) -> Cover {
    let box = box_grown(region, contact_reach(region));
    let low = cell_of(box.low);
    let size = min(vec3<u32>(cell_of(box.high) - low), vec3<u32>(COVER_MAX)) + 1u;
    return Cover(low, size, size.x * size.y * size.z);
}

// Cell `number` of a cover.
fn cover_cell(cover: Cover, number: u32) -> vec3<i32> {
    let rest = number / cover.size.x;
    return cover.low + vec3<i32>(vec3<u32>(number % cover.size.x, rest % cover.size.y, rest / cover.size.y));
}

// Place of a cell in the table `table` of two. Multipliers after Teschner et al. (2003), "Optimized spatial hashing
// for collision detection of deformable objects".
fn cell_place(table: u32, cell: vec3<i32>) -> u32 {
    let bits = bitcast<vec3<u32>>(cell);
    let mixed = (bits.x * 73856093u) ^ (bits.y * 19349663u) ^ (bits.z * 83492791u);
    return table * (contact.cell_mask + 1u) + ((mixed ^ (mixed >> 15u)) & contact.cell_mask);
}

// Names a cell among those around it: chains may be of several cells.
fn cell_name(cell: vec3<i32>) -> u32 {
    let bits = bitcast<vec3<u32>>(cell) & vec3<u32>(1023u);
    return bits.x | (bits.y << 10u) | (bits.z << 20u);
}
