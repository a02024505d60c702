// The end of an implicit substep without contact or colliders: `linear_end`, `velocity_add`, `position_advance`
// in one pass. Every workgroup finds out whether the solve broke down.
//!include model substep status call motion motion_out vectors solve solve_check solve_outcome

@compute @workgroup_size(SOLVE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    let state = solve_last(thread);
    // What is noted below is no other answer to this.
    let stands = is_stopped() || state.phase == SOLVE_BROKEN;
    if block == 0u && thread == 0u && state.phase != SOLVE_SKIPPED {
        solve_note(state);
    }
    for (var k = 0u; k < model.solve_repeats; k += 1u) {
        let particle = (block * model.solve_repeats + k) * SOLVE_THREADS + thread;
        if particle >= model.particle_count {
            continue;
        }
        var position = position_in[particle];
        var velocity = velocity_in[particle];
        if !stands {
            velocity = vec4f(add_scaled(velocity.xyz, 1.0, vector_get(VECTOR_SOLUTION, particle)), velocity.w);
            position = vec4f(add_scaled(position.xyz, call.amount, velocity.xyz), position.w);
        }
        position_out[particle] = position;
        velocity_out[particle] = velocity;
    }
}
