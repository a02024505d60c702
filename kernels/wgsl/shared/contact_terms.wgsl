// NUMERICS section 15, contact_linearise: what contacts give to the rows of their particles, w_a S sum w_b v_b, for each place of the table.

@group(0) @binding(84) var<storage, read_write> contact_terms: array<vec4f>;
