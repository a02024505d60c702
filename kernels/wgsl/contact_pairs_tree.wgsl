// NUMERICS section 15, contact_groups: boxes around the nodes of the tree, a workgroup for each. It looks at all groups below its node: no node
// waits for another one.
//!include model pair_task pair_ways pair_references pair_box pair_way_box surface pair_boxes

const TREE_THREADS: u32 = 64u;
var<workgroup> around: array<WayBox, TREE_THREADS>;

@compute @workgroup_size(TREE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let node = 1u + workgroup.x + workgroup.y * groups.x;
    let count = pair_task.group_count;
    if node >= count {
        return;
    }
    let level = firstLeadingBit(count) - firstLeadingBit(node);
    var bounds = ways_none();
    for (var k = thread; k < 1u << level; k += TREE_THREADS) {
        bounds = ways_union(bounds, stored_box(node_place((node << level) + k)));
    }
    around[thread] = bounds;
    for (var width = TREE_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            around[thread] = ways_union(around[thread], around[thread + width]);
        }
    }
    if thread == 0u {
        stored_box_set(node_place(node), around[0]);
    }
}
