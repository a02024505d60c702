// What fabric adds to each particle: diagonal block (xx, yy, zz, then xy, xz, yz) and right-hand side.

@group(0) @binding(67) var<storage, read_write> element_sums: array<vec4f>;
