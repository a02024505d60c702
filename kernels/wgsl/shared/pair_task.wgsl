// NUMERICS section 15: what a stage of contact of triangles is told by the host.

struct PairTask {
    // Pairs belong to the list that are not this far apart along the same axis at both sets of positions [m].
    reach: f32,
    // Time for which particles are followed [s].
    length: f32,
    // Distance of features at the end of their ways [m].
    delta: f32,
    // Distance below which pairs may touch [m].
    distance: f32,
    // Sum of the TASK_ constants.
    flags: u32,
    // Groups of triangles, a power of two: those of cloths, and behind them those of bodies.
    group_count: u32,
    // Pairs in the list.
    pair_count: u32,
    // Room for pairs in the list, and for those that are found.
    pair_capacity: u32,
    found_capacity: u32,
    // Workgroups of `contact_pairs_moved`.
    moved_blocks: u32,
    // Edges of the surface.
    edge_count: u32,
    // Particles, and nodes of bodies behind them.
    node_count: u32,
    // Groups of cloths: two triangles of bodies are no pair.
    own_group_count: u32,
    // Where the pairs of this task begin in the list: those of marked particles stand behind those of all.
    pair_first: u32,
    padding_0: u32,
    padding_1: u32,
}

@group(0) @binding(69) var<uniform> pair_task: PairTask;

// Only pairs with a marked particle are looked at, and listed: for the present ways, not for the two sets of positions.
const TASK_MARKED: u32 = 1u;
// Pairs that do not move are looked at as well.
const TASK_NEW: u32 = 2u;

fn task_has(flag: u32) -> bool {
    return (pair_task.flags & flag) != 0u;
}
