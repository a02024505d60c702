// NUMERICS section 5, `schwarz`: x = w Z b on a level, or the second time x + w Z (b - A x), of which the level below takes its share; that is the
// solution of the last level the first time. A
// workgroup for each run of 16 nodes.
//!include model call solve schwarz

const TEAM: u32 = 96u;
const UNKNOWNS: u32 = 96u;

//!include schwarz_factor schwarz_residual
// x += P of the unknowns of nodes of the level above, those of the nodes from `first` on.
fn schwarz_prolong(below: SchwarzLevel, thread: u32, first: u32, nodes: u32) {
    workgroupBarrier();
    let begin = NODE * schwarz_tables[below.groups + first];
    let end = NODE * schwarz_tables[below.groups + first + nodes];
    var node = first;
    for (var at = begin + thread; at < end; at += TEAM) {
        while NODE * schwarz_tables[below.groups + node + 1u] <= at {
            node += 1u;
        }
        let row = below.prolongation + NODE * at;
        let own = NODE * (node - first);
        var sum = 0.0;
        for (var k = 0u; k < NODE; k += 1u) {
            sum = fma(schwarz_number(row + k), scaled[own + k], sum);
        }
        schwarz_vectors[below.first + at] += sum;
    }
}

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
    let is_last = level.group_count == 0u;
    var value = 0.0;
    var scale = 0.0;
    var before = 0.0;
    if thread < size {
        scale = schwarz_number(level.scale + start + thread);
        if is_second && !is_last {
            value = node_residual(level, start + thread);
            before = schwarz_vectors[level.first + start + thread];
        } else {
            value = schwarz_vectors[level.right_side + start + thread];
        }
    }
    scaled[thread] = scale * value;
    let rows = level.factors + start / UNKNOWNS * factor_row(UNKNOWNS);
    factor_products(thread, rows, size);
    if thread < size {
        value = fma(level.weight, scale * factor_column(thread, rows, size), before);
        schwarz_vectors[select(level.first, level.second, is_second) + start + thread] = value;
    }
    if is_second && call.level > 0u {
        scaled[thread] = value;
        schwarz_prolong(schwarz_level(call.level - 1u), thread, start / NODE, size / NODE);
    }
}
