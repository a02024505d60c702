// Force on each particle [N], used by the single force stages only.

@group(0) @binding(7) var<storage, read_write> force: array<vec4f>;
