// NUMERICS section 15, contact_groups: boxes around the nodes of the tree, by one workgroup, level by level.
//!include model pair_task pair_box surface pair_boxes

const TREE_THREADS: u32 = 256u;

@compute @workgroup_size(TREE_THREADS)
fn main(@builtin(local_invocation_index) thread: u32) {
    for (var first = pair_task.group_count / 2u; first > 0u; first /= 2u) {
        storageBarrier();
        for (var node = first + thread; node < 2u * first; node += TREE_THREADS) {
            let left = stored_box(node_place(2u * node));
            let right = stored_box(node_place(2u * node + 1u));
            stored_box_set(node_place(node), box_union(left, right));
        }
    }
}
