// NUMERICS section 5, the preconditioner `schwarz`: the residual of the first solution of a level.

fn node_residual(level: SchwarzLevel, unknown: u32) -> f32 {
    let node = unknown / NODE;
    let row = unknown % NODE;
    var sum = 0.0;
    let end = schwarz_tables[level.rows + node + 1u];
    for (var at = schwarz_tables[level.rows + node]; at < end; at += 1u) {
        let block = level.blocks + NODE * (NODE * at + row);
        let other = level.first + NODE * schwarz_tables[level.columns + at];
        for (var k = 0u; k < NODE; k += 1u) {
            sum = fma(schwarz_number(block + k), schwarz_vectors[other + k], sum);
        }
    }
    return schwarz_vectors[level.right_side + unknown] - sum;
}
