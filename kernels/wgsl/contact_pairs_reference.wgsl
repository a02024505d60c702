// NUMERICS section 15, contact_pairs: takes the common motion out of the second set of positions.
//!include model pair_task pair_references

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= pair_task.node_count {
        return;
    }
    let place = pair_task.node_count + particle;
    pair_references[place] = vec4f(pair_references[place].xyz - pair_task.drift, 0.0);
}
