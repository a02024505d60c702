// NUMERICS section 15: a thread for each pair of the list, which `pair_is_wanted` looks at.
@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number >= pair_task.pair_count {
        return;
    }
    let pair = pair_get(pair_task.pair_first + number);
    if pair_is_wanted(pair) {
        pair_found(pair);
    }
}
