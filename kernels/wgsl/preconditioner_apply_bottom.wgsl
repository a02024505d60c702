// NUMERICS section 5, `schwarz`: on the last level, the products of the rows of its factor with the vector. Four threads for each row.
//!include model call solve schwarz

const TEAM: u32 = 64u;

var<workgroup> quarters: array<f32, TEAM>;

@compute @workgroup_size(TEAM)
fn main(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    if schwarz_rests(thread) {
        return;
    }
    let level = schwarz_level(call.level);
    let size = NODE * level.count;
    let k = (workgroup.x * TEAM + thread) / 4u;
    let quarter = thread % 4u;
    var sum = vec4<f32>(0.0);
    if k < size {
        var at = (level.factors + factor_row(k)) / 4u + quarter;
        for (var column = 4u * quarter; column <= k; column += CHUNK) {
            var x = vec4<f32>(0.0);
            for (var entry = 0u; entry < 4u; entry += 1u) {
                if column + entry < size {
                    x[entry] = schwarz_number(level.scale + column + entry) * schwarz_vectors[level.right_side + column + entry];
                }
            }
            sum = fma(schwarz_factors[at], x, sum);
            at += CHUNK / 4u;
        }
    }
    quarters[thread] = (sum.x + sum.y) + (sum.z + sum.w);
    workgroupBarrier();
    if quarter == 0u && k < size {
        schwarz_vectors[level.first + k] = (quarters[thread] + quarters[thread + 1u]) + (quarters[thread + 2u] + quarters[thread + 3u]);
    }
}
