// NUMERICS section 5, `schwarz`: P^T of a vector. A workgroup for each group.
//!include model call vectors solve schwarz

const TEAM: u32 = 96u;

var<workgroup> entries: array<f32, TEAM>;
var<workgroup> products: array<f32, 2u * TEAM>;

@compute @workgroup_size(TEAM)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if schwarz_rests(thread) {
        return;
    }
    let head = schwarz_head();
    let group = workgroup.x + workgroup.y * groups.x;
    if group >= head.group_count {
        return;
    }
    let start = 3u * schwarz_tables[head.group_starts + group];
    let size = 3u * schwarz_tables[head.group_starts + group + 1u] - start;
    if thread < size {
        let particle = schwarz_tables[head.order + (start + thread) / 3u];
        entries[thread] = vectors[call.vector_from * model.particle_count + particle][thread % 3u];
    }
    workgroupBarrier();
    // Of each particle, then of all.
    for (var task = thread; task < 2u * size; task += TEAM) {
        let at = 3u * (task / NODE);
        let row = head.prolongation + NODE * (start + at) + task % NODE;
        let second = fma(schwarz_number(row + NODE), entries[at + 1u], schwarz_number(row) * entries[at]);
        products[task] = fma(schwarz_number(row + 2u * NODE), entries[at + 2u], second);
    }
    workgroupBarrier();
    if thread < NODE {
        var sum = 0.0;
        for (var k = thread; k < 2u * size; k += NODE) {
            sum += products[k];
        }
        schwarz_vectors[schwarz_level(0u).right_side + NODE * group + thread] = sum;
    }
}
