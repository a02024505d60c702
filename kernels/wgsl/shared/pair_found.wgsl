// Hands a pair to the host. The order in which they come has no meaning.
fn pair_found(pair: Pair) {
    let number = atomicAdd(&pair_results.found, 1u);
    if number >= pair_task.found_capacity {
        return;
    }
    let at = 2u * MOVED_WORDS * pair_task.moved_blocks + PAIR_WORDS * number;
    pair_results.words[at] = pair.particles.x;
    pair_results.words[at + 1u] = pair.particles.y;
    pair_results.words[at + 2u] = pair.particles.z;
    pair_results.words[at + 3u] = pair.particles.w;
    pair_results.words[at + 4u] = pair.first;
    pair_results.words[at + 5u] = pair.second;
}
