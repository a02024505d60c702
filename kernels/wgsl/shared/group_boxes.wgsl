// The boxes of all groups at the positions that are read, two corners each.
@group(0) @binding(24) var<storage, read> group_boxes_in: array<vec4f>;

fn box_in(group: u32) -> Box {
    return Box(group_boxes_in[2u * group].xyz, group_boxes_in[2u * group + 1u].xyz);
}
