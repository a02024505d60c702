// NUMERICS section 5, `schwarz`: the residual of the nodes of a level as the right-hand side of their groups. A workgroup for each group of
// eight.
//!include model call solve schwarz schwarz_residual

const CLUSTER: u32 = 48u;

var<workgroup> residuals: array<f32, CLUSTER>;

@compute @workgroup_size(CLUSTER)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if schwarz_rests(thread) {
        return;
    }
    let level = schwarz_level(call.level);
    let group = workgroup.x + workgroup.y * groups.x;
    if group >= level.group_count {
        return;
    }
    let start = NODE * schwarz_tables[level.groups + group];
    let size = NODE * schwarz_tables[level.groups + group + 1u] - start;
    if thread < size {
        residuals[thread] = node_residual(level, start + thread);
    }
    workgroupBarrier();
    // Of each node, then of all.
    var of_node = 0.0;
    if thread < size {
        let node = thread / NODE * NODE;
        for (var k = 0u; k < NODE; k += 1u) {
            of_node = fma(schwarz_number(level.prolongation + NODE * (start + node + k) + thread % NODE), residuals[node + k], of_node);
        }
    }
    workgroupBarrier();
    residuals[thread] = of_node;
    workgroupBarrier();
    if thread < NODE {
        var sum = 0.0;
        for (var k = thread; k < size; k += NODE) {
            sum += residuals[k];
        }
        schwarz_vectors[schwarz_level(call.level + 1u).right_side + NODE * group + thread] = sum;
    }
}
