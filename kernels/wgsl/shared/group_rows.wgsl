// For each group its region and the groups that may come near it (`group_row`).
@group(0) @binding(26) var<storage, read> group_rows: array<vec4<u32>>;
