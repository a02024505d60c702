// Partners that the response leaves out: n + 1 offsets, then the rows, ascending.
@group(0) @binding(29) var<storage, read> exclusions: array<u32>;

fn is_left_out(particle: u32, partner: u32) -> bool {
    var low = exclusions[particle];
    var high = exclusions[particle + 1u];
    while low < high {
        let middle = (low + high) / 2u;
        let found = exclusions[model.particle_count + 1u + middle];
        if found == partner {
            return true;
        }
        if found < partner {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return false;
}
