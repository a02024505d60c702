// NUMERICS section 6, torque_correct, last pass: takes the rotation out of the solution.
//!include model status motion vectors measure_sum piece

// The piece of each particle; NO_PARTICLE for those in none that is free.
@group(0) @binding(53) var<storage, read> piece_of: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let piece = piece_of[particle];
    if piece == NO_PARTICLE {
        return;
    }
    let turn = piece_turns[piece];
    let arm = (position_in[particle].xyz - turn.origin) - turn.centre;
    let change = vector_get(VECTOR_SOLUTION, particle) - cross_product(turn.rate, arm);
    vector_set(VECTOR_SOLUTION, particle, change);
}
