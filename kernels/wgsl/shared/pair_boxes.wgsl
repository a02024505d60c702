// NUMERICS section 15: boxes around triangles in the order of their groups, then those around the nodes of a binary tree over the groups, a heap: the
// children of node k are 2 k and 2 k + 1, and groups are its last nodes.

@group(0) @binding(72) var<storage, read_write> pair_boxes: array<vec4f>;

fn stored_box(place: u32) -> Box {
    return Box(pair_boxes[2u * place].xyz, pair_boxes[2u * place + 1u].xyz);
}

fn stored_box_set(place: u32, bounds: Box) {
    pair_boxes[2u * place] = vec4f(bounds.low, 0.0);
    pair_boxes[2u * place + 1u] = vec4f(bounds.high, 0.0);
}

fn node_place(node: u32) -> u32 {
    return SLOTS * pair_task.group_count + node;
}
