// NUMERICS section 15: what stages of contact of triangles tell the host.

struct PairResults {
    // Pairs that were found, and pairs in the list, even where there was no room for them.
    found: atomic<u32>,
    listed: atomic<u32>,
    padding_0: u32,
    padding_1: u32,
    // The results of the workgroups of `contact_pairs_moved`, for starts and then for ends, then the pairs that were found.
    words: array<u32>,
}

@group(0) @binding(74) var<storage, read_write> pair_results: PairResults;

// Words of the result of a workgroup of `contact_pairs_moved`.
const MOVED_WORDS: u32 = 14u;
