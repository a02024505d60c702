// NUMERICS section 5, the preconditioner `schwarz`: an inverse factor, sum over k of w_k w_k^T, times a vector by one workgroup of
// TEAM threads, for blocks of UNKNOWNS unknowns at most.

// The vector, filled up with zeros to whole chunks; quarters of products of rows; products.
var<workgroup> scaled: array<f32, UNKNOWNS>;
var<workgroup> quarters: array<f32, 4u * UNKNOWNS>;
var<workgroup> products: array<f32, UNKNOWNS>;

// Where row k of a factor starts: row j has j / 16 + 1 chunks.
fn factor_row(k: u32) -> u32 {
    let whole = k / CHUNK;
    return CHUNK * (CHUNK * whole * (whole + 1u) / 2u + k % CHUNK * (whole + 1u));
}

// Products of all rows with `scaled`, which all threads have written.
fn factor_products(thread: u32, rows: u32, size: u32) {
    workgroupBarrier();
    for (var task = thread; task < 4u * size; task += TEAM) {
        let k = task / 4u;
        var at = rows + factor_row(k) + 4u * (task % 4u);
        var column = 4u * (task % 4u);
        var sum = 0.0;
        for (var chunk = 0u; chunk <= k / CHUNK; chunk += 1u) {
            sum = fma(schwarz_factors[at], scaled[column], sum);
            sum = fma(schwarz_factors[at + 1u], scaled[column + 1u], sum);
            sum = fma(schwarz_factors[at + 2u], scaled[column + 2u], sum);
            sum = fma(schwarz_factors[at + 3u], scaled[column + 3u], sum);
            at += CHUNK;
            column += CHUNK;
        }
        quarters[task] = sum;
    }
    workgroupBarrier();
    for (var k = thread; k < size; k += TEAM) {
        products[k] = (quarters[4u * k] + quarters[4u * k + 1u]) + (quarters[4u * k + 2u] + quarters[4u * k + 3u]);
    }
    workgroupBarrier();
}

// Entry t of the result.
fn factor_column(t: u32, rows: u32, size: u32) -> f32 {
    var sum = 0.0;
    for (var k = t / CHUNK * CHUNK; k < size; k += 1u) {
        sum = fma(schwarz_factors[rows + factor_row(k) + t], products[k], sum);
    }
    return sum;
}
