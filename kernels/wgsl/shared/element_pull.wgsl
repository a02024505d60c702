// NUMERICS section 6: the constant stiffness of triangles of fabric.

// The rows of `element_entries` with one number in place of a block: for each slice of 32 rows where its entries begin, and the end; an entry has
// 32 columns, NO_COLUMN behind the last one of a row, then 32 numbers [N/m].
@group(0) @binding(80) var<storage, read> constant_entries: array<u32>;

const SLICE: u32 = 32u;
const CONSTANT_WORDS: u32 = 64u;
const NO_COLUMN: u32 = 0xffffffffu;

// The sum with k (v_j - v_i) of all neighbours added [N/s].
fn element_pull(start: vec3f, particle: u32, velocity: vec3f) -> vec3f {
    var sum = start;
    let slice = particle / SLICE;
    let end = constant_entries[slice + 1u];
    for (var at = constant_entries[slice] + particle % SLICE; at < end; at += CONSTANT_WORDS) {
        let column = constant_entries[at];
        if column == NO_COLUMN {
            break;
        }
        let stiffness = bitcast<f32>(constant_entries[at + SLICE]);
        sum = add_scaled(sum, stiffness, velocity_in[column].xyz - velocity);
    }
    return sum;
}
