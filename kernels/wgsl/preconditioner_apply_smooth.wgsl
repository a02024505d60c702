// NUMERICS section 5, `schwarz`: x = w Z b on a level, or the second time x + w Z (b - A x), of which the level below takes its share. A
// workgroup for each run of 16 nodes.
//!include model call solve schwarz

const TEAM: u32 = 96u;
const UNKNOWNS: u32 = 96u;

//!include schwarz_factor schwarz_residual schwarz_prolong

@compute @workgroup_size(TEAM)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if schwarz_rests(thread) {
        return;
    }
    let level = schwarz_level(call.level);
    let unknowns = NODE * level.count;
    let start = (workgroup.x + workgroup.y * groups.x) * UNKNOWNS;
    if start >= unknowns {
        return;
    }
    let size = min(UNKNOWNS, unknowns - start);
    let is_second = call_has(CALL_SECOND);
    var value = 0.0;
    var scale = 0.0;
    var before = 0.0;
    if thread < size {
        scale = schwarz_number(level.scale + start + thread);
        if is_second {
            value = node_residual(level, start + thread);
            before = schwarz_vectors[level.first + start + thread];
        } else {
            value = schwarz_vectors[level.right_side + start + thread];
        }
    }
    scaled[thread] = scale * value;
    let rows = level.factors + start / UNKNOWNS * factor_row(UNKNOWNS);
    let sum = factor_times(thread, rows, size);
    if thread < size {
        value = fma(level.weight, scale * sum, before);
        schwarz_vectors[select(level.first, level.second, is_second) + start + thread] = value;
    }
    if is_second && call.level > 0u {
        scaled[thread] = value;
        schwarz_prolong(schwarz_level(call.level - 1u), thread, start / NODE, size / NODE);
    }
}
