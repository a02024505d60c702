// The boxes of all groups at the positions that are written, two corners each.
@group(0) @binding(25) var<storage, read_write> group_boxes_out: array<vec4f>;

// Keeps the box around the present positions of a group, those of the first GROUP threads.
fn box_keep(group: u32, thread: u32, position: vec3f) {
    let box = group_box(thread, position);
    if thread < 2u {
        group_boxes_out[2u * group + thread] = vec4f(select(box.high, box.low, thread == 0u), 0.0);
    }
}
