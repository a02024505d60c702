// Number of partners that each particle is in contact with.
@group(0) @binding(19) var<storage, read_write> contact_counts: array<u32>;
