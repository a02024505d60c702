// NUMERICS section 15, contact_pairs: how far particles have moved since both sets of positions, for starts and for ends of ways: what tells
// whether the list of pairs is complete.
//!include model pair_task pair_ways pair_references finite pair_results

const MOVED_THREADS: u32 = 128u;
var<workgroup> moved: array<array<f32, MOVED_WORDS>, MOVED_THREADS>;

@compute @workgroup_size(MOVED_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    // For each of both halves, starts and ends, some workgroups.
    let block = workgroup.x + workgroup.y * groups.x;
    let blocks = pair_task.moved_blocks;
    let half = block / blocks;
    // Largest numbers of all: ways since the first set, their negatives, the same of the second set, the largest coordinate, and whether something is
    // not finite.
    var up_first = vec3f(-3e38);
    var down_first = vec3f(-3e38);
    var up_second = vec3f(-3e38);
    var down_second = vec3f(-3e38);
    var largest = 0.0;
    var bad = 0.0;
    for (var i = block % blocks * MOVED_THREADS + thread; i < pair_task.node_count; i += blocks * MOVED_THREADS) {
        let x = pair_ways[half * pair_task.node_count + i].xyz;
        if !is_finite(x) {
            bad = 1.0;
            continue;
        }
        let a = reference_first(i);
        let b = reference_second(i);
        up_first = max(up_first, x - a);
        down_first = max(down_first, a - x);
        up_second = max(up_second, x - b);
        down_second = max(down_second, b - x);
        let size = abs(x);
        largest = max(largest, max(max(size.x, size.y), size.z));
    }
    moved[thread] = array<f32, MOVED_WORDS>(
        up_first.x, up_first.y, up_first.z, down_first.x, down_first.y, down_first.z,
        up_second.x, up_second.y, up_second.z, down_second.x, down_second.y, down_second.z,
        largest, bad,
    );
    for (var width = MOVED_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            for (var k = 0u; k < MOVED_WORDS; k += 1u) {
                moved[thread][k] = max(moved[thread][k], moved[thread + width][k]);
            }
        }
    }
    workgroupBarrier();
    if thread < MOVED_WORDS && half < 2u {
        pair_results.words[MOVED_WORDS * block + thread] = bitcast<u32>(moved[0][thread]);
    }
}
