// NUMERICS section 5, `schwarz`: the solution of the last level from the products of the rows of its factor, of which the level below takes its share. A
// workgroup for each eight nodes, eight threads for each four of their unknowns.
//!include model call solve schwarz

const TEAM: u32 = 96u;
const UNKNOWNS: u32 = 48u;
const PARTS: u32 = 4u * TEAM / UNKNOWNS;

var<workgroup> columns: array<vec4<f32>, TEAM>;
var<workgroup> scaled: array<f32, UNKNOWNS>;

//!include schwarz_prolong

@compute @workgroup_size(TEAM)
fn main(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    if schwarz_rests(thread) {
        return;
    }
    let level = schwarz_level(call.level);
    let size = NODE * level.count;
    let start = workgroup.x * UNKNOWNS;
    let column = thread % (UNKNOWNS / 4u);
    let own = start + 4u * column;
    var sum = vec4<f32>(0.0);
    // A row has whole chunks up to its diagonal, filled up with zeros.
    for (var k = own / CHUNK * CHUNK + thread / (UNKNOWNS / 4u); k < size; k += PARTS) {
        sum = fma(schwarz_factors[(level.factors + factor_row(k) + own) / 4u], vec4<f32>(schwarz_vectors[level.first + k]), sum);
    }
    columns[thread] = sum;
    workgroupBarrier();
    if thread < UNKNOWNS && start + thread < size {
        var all = vec4<f32>(0.0);
        for (var part = 0u; part < PARTS; part += 1u) {
            all += columns[part * (UNKNOWNS / 4u) + thread / 4u];
        }
        let value = schwarz_number(level.scale + start + thread) * all[thread % 4u];
        schwarz_vectors[level.second + start + thread] = value;
        scaled[thread] = value;
    }
    if call.level > 0u {
        schwarz_prolong(schwarz_level(call.level - 1u), thread, start / NODE, min(UNKNOWNS, size - start) / NODE);
    }
}
