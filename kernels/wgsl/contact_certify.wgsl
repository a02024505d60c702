// NUMERICS section 15, contact_certify: the pairs of the list of which nothing proves that their features do not meet.
//!include model pair_task pair_ways pair_list pair_results pair_found pair_each certificate

fn pair_is_wanted(pair: Pair) -> bool {
    let p = pair.particles;
    if task_has(TASK_MARKED) && !(is_marked(p.x) || is_marked(p.y) || is_marked(p.z) || is_marked(p.w)) {
        return false;
    }
    let start = Points(array<vec3f, 4>(way_start(p.x), way_start(p.y), way_start(p.z), way_start(p.w)));
    let end = Points(array<vec3f, 4>(way_end(p.x), way_end(p.y), way_end(p.z), way_end(p.w)));
    // What does not move stays as it is, which needs no proof unless it is new.
    let rests = all(start.x[0] == end.x[0]) && all(start.x[1] == end.x[1]) && all(start.x[2] == end.x[2]) && all(start.x[3] == end.x[3]);
    return (task_has(TASK_NEW) || !rests) && !is_proven(start, end, pair_is_edges(pair), pair_task.delta);
}
