// NUMERICS section 5, the preconditioner `schwarz`: its tables, which the host builds. Whatever lies above the particles is
// in single precision here.

// Rows of the inverse factors of the runs of nodes of all levels, four numbers each.
@group(0) @binding(76) var<storage, read> schwarz_factors: array<vec4<f32>>;
// Words: those of `SchwarzHead`, LEVEL_WORDS of `SchwarzLevel` for each level, and what these tell the places of.
@group(0) @binding(77) var<storage, read> schwarz_tables: array<u32>;
// Right-hand side and both solutions of all levels.
@group(0) @binding(78) var<storage, read_write> schwarz_vectors: array<f32>;

// Unknowns of a chunk of a row of a factor, of a node.
const CHUNK: u32 = 16u;
const NODE: u32 = 6u;
const HEAD_WORDS: u32 = 6u;
const LEVEL_WORDS: u32 = 16u;

// Particles, those of a group one after the other; where groups start; of each particle place and group; rows of the prolongation.
struct SchwarzHead {
    group_count: u32,
    order: u32,
    group_starts: u32,
    places: u32,
    group_of: u32,
    prolongation: u32,
}

// Nodes and groups of them; weight of the smoother; starts, columns and blocks of the rows of the matrix; rows and scale of the factors of
// runs of nodes; what unit unknowns of a group do to each node; where the nodes of groups start; right-hand side, and solutions before and
// after the second smoothing.
struct SchwarzLevel {
    count: u32,
    group_count: u32,
    weight: f32,
    rows: u32,
    columns: u32,
    blocks: u32,
    factors: u32,
    scale: u32,
    prolongation: u32,
    groups: u32,
    right_side: u32,
    first: u32,
    second: u32,
}

fn schwarz_head() -> SchwarzHead {
    return SchwarzHead(
        schwarz_tables[0], schwarz_tables[1], schwarz_tables[2],
        schwarz_tables[3], schwarz_tables[4], schwarz_tables[5],
    );
}

fn schwarz_level(number: u32) -> SchwarzLevel {
    let at = HEAD_WORDS + LEVEL_WORDS * number;
    return SchwarzLevel(
        schwarz_tables[at], schwarz_tables[at + 1u], bitcast<f32>(schwarz_tables[at + 2u]), schwarz_tables[at + 3u],
        schwarz_tables[at + 4u], schwarz_tables[at + 5u], schwarz_tables[at + 6u], schwarz_tables[at + 7u],
        schwarz_tables[at + 8u], schwarz_tables[at + 9u], schwarz_tables[at + 10u], schwarz_tables[at + 11u],
        schwarz_tables[at + 12u],
    );
}

fn schwarz_number(at: u32) -> f32 {
    return bitcast<f32>(schwarz_tables[at]);
}

// Where row k of a factor starts: row j has j / 16 + 1 chunks.
fn factor_row(k: u32) -> u32 {
    let whole = k / CHUNK;
    return CHUNK * (CHUNK * whole * (whole + 1u) / 2u + k % CHUNK * (whole + 1u));
}

// Whether there is nothing to do, as the solve has ended: for all threads of a workgroup.
fn schwarz_rests(thread: u32) -> bool {
    let phase = phase_uniform(thread, solve.next.phase);
    return call_has(CALL_SOLVE) && phase != SOLVE_RUNNING;
}
