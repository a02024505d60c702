// NUMERICS section 15: boxes around triangles in the order of their groups, then those around the nodes of a binary tree over the groups, a heap: the
// children of node k are 2 k and 2 k + 1, and groups are its last nodes.

@group(0) @binding(72) var<storage, read_write> pair_boxes: array<vec4f>;

fn stored_box(place: u32) -> WayBox {
    let at = 4u * place;
    let first = Box(pair_boxes[at].xyz, pair_boxes[at + 1u].xyz);
    return WayBox(first, Box(pair_boxes[at + 2u].xyz, pair_boxes[at + 3u].xyz));
}

fn stored_box_set(place: u32, bounds: WayBox) {
    let at = 4u * place;
    pair_boxes[at] = vec4f(bounds.first.low, 0.0);
    pair_boxes[at + 1u] = vec4f(bounds.first.high, 0.0);
    pair_boxes[at + 2u] = vec4f(bounds.second.low, 0.0);
    pair_boxes[at + 3u] = vec4f(bounds.second.high, 0.0);
}

fn node_place(node: u32) -> u32 {
    return SLOTS * pair_task.group_count + node;
}
