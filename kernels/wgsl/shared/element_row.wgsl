// NUMERICS sections 11 and 12, matrix_apply: the blocks off the diagonal that triangles of fabric add.

// For each slice of 32 rows where its entries begin, and the end. An entry has 32 columns, one for each row, NO_COLUMN behind the last one of a
// row, then nine times 32 numbers, row by row of the blocks.
@group(0) @binding(66) var<storage, read> element_entries: array<u32>;

const SLICE: u32 = 32u;
const ENTRY_WORDS: u32 = 320u;
const NO_COLUMN: u32 = 0xffffffffu;

fn block_row(at: u32) -> vec3f {
    return bitcast<vec3f>(vec3<u32>(element_entries[at], element_entries[at + SLICE], element_entries[at + 2u * SLICE]));
}

fn element_row(start: vec3f, particle: u32, vector: u32) -> vec3f {
    var sum = vec3f(0.0);
    let slice = particle / SLICE;
    let end = element_entries[slice + 1u];
    for (var at = element_entries[slice] + particle % SLICE; at < end; at += ENTRY_WORDS) {
        let column = element_entries[at];
        if column == NO_COLUMN {
            break;
        }
        let other = vector_get(vector, column);
        sum += vec3f(
            dot_product(block_row(at + SLICE), other),
            dot_product(block_row(at + 4u * SLICE), other),
            dot_product(block_row(at + 7u * SLICE), other),
        );
    }
    return start + sum;
}
