// The partners that each particle is in contact with, ascending: first entry and number of entries.

@group(0) @binding(17) var<storage, read> contact_rows: array<vec2<u32>>;
@group(0) @binding(18) var<storage, read> contact_entries: array<u32>;
