// NUMERICS section 6, torque_correct, first pass: sums over blocks of the particles of each free piece.
//!include model substep status motion force vectors measure_sum piece

@compute @workgroup_size(MEASURE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let number = workgroup.x + workgroup.y * groups.x;
    let is_block = number < arrayLength(&piece_blocks);
    let block = piece_blocks[select(0u, number, is_block)];
    let origin = position_in[piece_particles[piece_blocks[piece_rows[block.x].x].y]].xyz;
    let zero = Sum(vec4f(0.0), vec4f(0.0));
    var first = zero;
    var second = zero;
    var mixed = zero;
    var angular = zero;
    for (var at = block.y + thread; at < block.z; at += MEASURE_THREADS) {
        let particle = piece_particles[at];
        let mass = velocity_in[particle].w;
        let d = position_in[particle].xyz - origin;
        let change = vector_get(VECTOR_SOLUTION, particle);
        let p = fma(vec3f(-substep.length), force[particle].xyz, mass * change);
        let arm = cross_product(d, p);
        first = sum_add(first, Sum(vec4f(mass * d, mass), vec4f(0.0)));
        second = sum_add(second, Sum(vec4f(mass * d * d, p.x), vec4f(0.0)));
        mixed = sum_add(mixed, Sum(vec4f(mass * d * d.yzx, p.y), vec4f(0.0)));
        angular = sum_add(angular, Sum(vec4f(arm, p.z), vec4f(0.0)));
    }
    first = tree_sum(thread, first);
    second = tree_sum(thread, second);
    mixed = tree_sum(thread, mixed);
    angular = tree_sum(thread, angular);
    if thread == 0u && is_block {
        let at = number * PIECE_WORDS;
        piece_partials[at] = first.high;
        piece_partials[at + 1u] = first.low;
        piece_partials[at + 2u] = second.high;
        piece_partials[at + 3u] = second.low;
        piece_partials[at + 4u] = mixed.high;
        piece_partials[at + 5u] = mixed.low;
        piece_partials[at + 6u] = angular.high;
        piece_partials[at + 7u] = angular.low;
    }
}
