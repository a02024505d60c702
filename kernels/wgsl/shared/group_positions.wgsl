// The particles of all groups at the positions that are read, side by side: position [m] and number; NONE where there is
// none.
@group(0) @binding(58) var<storage, read> group_positions_in: array<vec4<u32>>;
