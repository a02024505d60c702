// The pair of buffers that stages write, or change in place.

@group(0) @binding(5) var<storage, read_write> position_out: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> velocity_out: array<vec4f>;
