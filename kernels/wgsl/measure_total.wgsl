// NUMERICS section 10: the results of all blocks together, blocks in fixed order.
//!include model measure_sum

@group(0) @binding(30) var<storage, read> measure_partials: array<vec4<u32>>;
// The results, as one block more.
@group(0) @binding(31) var<storage, read_write> measure_result: array<vec4<u32>>;

fn partial_sum(at: u32) -> Sum {
    return Sum(
        bitcast<vec4f>(measure_partials[at]),
        bitcast<vec4f>(measure_partials[at + 1u]),
    );
}

@compute @workgroup_size(MEASURE_THREADS)
fn main(@builtin(local_invocation_index) thread: u32) {
    let zero = Sum(vec4f(0.0), vec4f(0.0));
    var first = zero;
    var second = zero;
    var third = zero;
    var extremes = extremes_none();
    for (var block = thread; block < model.measure_blocks; block += MEASURE_THREADS) {
        let at = block * MEASURE_WORDS;
        first = sum_add(first, partial_sum(at));
        second = sum_add(second, partial_sum(at + 2u));
        third = sum_add(third, partial_sum(at + 4u));
        let largest = bitcast<vec4f>(measure_partials[at + 6u]);
        let particles = measure_partials[at + 7u];
        let more = Extremes(largest.x, particles.x, largest.y, particles.y, particles.z);
        extremes = extremes_merge(extremes, more);
    }
    first = tree_sum(thread, first);
    second = tree_sum(thread, second);
    third = tree_sum(thread, third);
    extremes = tree_extremes(thread, extremes);
    if thread == 0u {
        measure_result[0] = bitcast<vec4<u32>>(first.high);
        measure_result[1] = bitcast<vec4<u32>>(first.low);
        measure_result[2] = bitcast<vec4<u32>>(second.high);
        measure_result[3] = bitcast<vec4<u32>>(second.low);
        measure_result[4] = bitcast<vec4<u32>>(third.high);
        measure_result[5] = bitcast<vec4<u32>>(third.low);
        let particles = vec3<u32>(extremes.strain_particle, extremes.non_finite, extremes.contacts);
        measure_result[6] = bitcast<vec4<u32>>(vec4f(extremes.strain_max, extremes.penetration, 0.0, 0.0));
        measure_result[7] = vec4<u32>(particles, 0u);
    }
}
