// The region that a group is expected to stay in.

fn group_region(group: u32) -> Box {
    let row = group_row(group);
    return Box(bitcast<vec3f>(group_rows[row].xyz), bitcast<vec3f>(group_rows[row + 1u].xyz));
}
