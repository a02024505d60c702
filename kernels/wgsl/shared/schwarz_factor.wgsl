// NUMERICS section 5, the preconditioner `schwarz`: an inverse factor, sum over k of w_k w_k^T, times a vector by one workgroup of
// TEAM threads, for blocks of UNKNOWNS unknowns: as many. A thread reads four numbers at once.

// The vector, filled up with zeros to whole chunks; quarters of products of rows; products; quarters of the sums of columns, four of them each.
var<workgroup> scaled: array<f32, UNKNOWNS>;
var<workgroup> quarters: array<f32, 4u * UNKNOWNS>;
var<workgroup> products: array<f32, UNKNOWNS>;
var<workgroup> columns: array<vec4<f32>, UNKNOWNS>;

// Entry `thread` of the product with `scaled`, which all threads have written.
fn factor_times(thread: u32, rows: u32, size: u32) -> f32 {
    workgroupBarrier();
    let quarter = thread % 4u;
    for (var k = thread / 4u; k < size; k += TEAM / 4u) {
        var at = (rows + factor_row(k)) / 4u + quarter;
        var sum = vec4<f32>(0.0);
        for (var column = 4u * quarter; column <= k; column += CHUNK) {
            let x = vec4<f32>(scaled[column], scaled[column + 1u], scaled[column + 2u], scaled[column + 3u]);
            sum = fma(schwarz_factors[at], x, sum);
            at += CHUNK / 4u;
        }
        quarters[4u * k + quarter] = (sum.x + sum.y) + (sum.z + sum.w);
    }
    workgroupBarrier();
    if thread < size {
        let at = 4u * thread;
        products[thread] = (quarters[at] + quarters[at + 1u]) + (quarters[at + 2u] + quarters[at + 3u]);
    }
    workgroupBarrier();
    let column = thread % (UNKNOWNS / 4u);
    var sum = vec4<f32>(0.0);
    for (var k = column / 4u * CHUNK + thread / (UNKNOWNS / 4u); k < size; k += 4u) {
        sum = fma(schwarz_factors[(rows + factor_row(k)) / 4u + column], vec4<f32>(products[k]), sum);
    }
    columns[thread] = sum;
    workgroupBarrier();
    let own = thread / 4u;
    let all = (columns[own] + columns[own + UNKNOWNS / 4u]) + (columns[own + UNKNOWNS / 2u] + columns[own + 3u * UNKNOWNS / 4u]);
    return all[thread % 4u];
}
