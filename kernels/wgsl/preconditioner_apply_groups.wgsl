// NUMERICS section 5, `schwarz`: what the factors of groups make of a vector, and P^T of it. A workgroup for each group.
//!include model call vectors solve schwarz

const TEAM: u32 = 96u;
const UNKNOWNS: u32 = 96u;

//!include schwarz_factor

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
    var particle = 0u;
    var value = 0.0;
    var scale = 0.0;
    if thread < size {
        particle = schwarz_tables[head.order + (start + thread) / 3u];
        value = vectors[call.vector_from * model.particle_count + particle][thread % 3u];
        scale = schwarz_number(head.scale + start + thread);
    }
    products[thread] = value;
    workgroupBarrier();
    // Of each particle, then of all.
    for (var task = thread; task < 2u * size; task += TEAM) {
        let at = 3u * (task / NODE);
        let row = head.prolongation + NODE * (start + at) + task % NODE;
        let second = fma(schwarz_number(row + NODE), products[at + 1u], schwarz_number(row) * products[at]);
        quarters[task] = fma(schwarz_number(row + 2u * NODE), products[at + 2u], second);
    }
    workgroupBarrier();
    if thread < NODE {
        var sum = 0.0;
        for (var k = thread; k < 2u * size; k += NODE) {
            sum += quarters[k];
        }
        schwarz_vectors[schwarz_level(0u).right_side + NODE * group + thread] = sum;
    }
    scaled[thread] = scale * value;
    let rows = schwarz_tables[head.row_starts + group];
    let sum = factor_times(thread, rows, size);
    if thread < size {
        vectors[call.vector_to * model.particle_count + particle][thread % 3u] = scale * sum;
    }
}
