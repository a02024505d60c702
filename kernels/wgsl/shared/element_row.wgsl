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

// The block at `at` times the difference from the vector of the particle to that of its column, which stands for the diagonal block.
fn element_term(at: u32, column: u32, particle: u32, vector: u32, own: vec3f) -> vec3f {
    let other = vector_get(vector, select(column, particle, column == NO_COLUMN)) - own;
    return vec3f(
        dot_product(block_row(at + SLICE), other),
        dot_product(block_row(at + 4u * SLICE), other),
        dot_product(block_row(at + 7u * SLICE), other),
    );
}

// Four blocks at a time, so that the device waits once for what they read; what lies beyond the row is read again and left out.
fn element_row(start: vec3f, particle: u32, vector: u32, own: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    let slice = particle / SLICE;
    let first = element_entries[slice] + particle % SLICE;
    let end = element_entries[slice + 1u];
    for (var at_a = first; at_a < end; at_a += 4u * ENTRY_WORDS) {
        let last = end - ENTRY_WORDS + particle % SLICE;
        let at_b = min(at_a + ENTRY_WORDS, last);
        let at_c = min(at_a + 2u * ENTRY_WORDS, last);
        let at_d = min(at_a + 3u * ENTRY_WORDS, last);
        let a = element_entries[at_a];
        let b = element_entries[at_b];
        let c = element_entries[at_c];
        let d = element_entries[at_d];
        let term_a = element_term(at_a, a, particle, vector, own);
        let term_b = element_term(at_b, b, particle, vector, own);
        let term_c = element_term(at_c, c, particle, vector, own);
        let term_d = element_term(at_d, d, particle, vector, own);
        if a == NO_COLUMN {
            break;
        }
        sum += term_a;
        sum = select(sum, sum + term_b, b != NO_COLUMN && at_a + ENTRY_WORDS < end);
        sum = select(sum, sum + term_c, c != NO_COLUMN && at_a + 2u * ENTRY_WORDS < end);
        sum = select(sum, sum + term_d, d != NO_COLUMN && at_a + 3u * ENTRY_WORDS < end);
    }
    return start + sum;
}
