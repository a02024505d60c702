// NUMERICS section 10: energies and stretches of triangles of fabric, over blocks of them that follow those of particles, after the first part of bending_forces.
//!include model motion measure_sum fabric membrane membrane_motion plate fold_tables fold_numbers fold_moments

// The results of each block, MEASURE_WORDS each.
@group(0) @binding(30) var<storage, read_write> measure_partials: array<vec4<u32>>;

const TRIANGLES_PER_THREAD: u32 = 4u;

@compute @workgroup_size(MEASURE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    let first_block = model.measure_blocks - (model.element_count + 1023u) / 1024u;
    // Sums of |strain| and of energies, as those of springs, which both of their ends count.
    var sum = Sum(vec4f(0.0), vec4f(0.0));
    var extremes = extremes_none();
    for (var k = 0u; k < TRIANGLES_PER_THREAD; k += 1u) {
        let number = (block * TRIANGLES_PER_THREAD + k) * MEASURE_THREADS + thread;
        if number < model.element_count {
            let triangle = membrane_of(number);
            let strain = green_strain(positions_deformation(triangle));
            let apart = strain.x - strain.y;
            let across = 2.0 * strain.z;
            let radius = sqrt(fma(across, across, apart * apart));
            let stretch = sqrt(max(1.0 + (strain.x + strain.y) + radius, 0.0)) - 1.0;
            let roots = energy_roots(number, 1.0, 0.0);
            let bent = 0.5 * dot_product(roots, roots);
            let energy = fma(fabric_response(triangle.fabric, strain).energy, triangle.area, bent);
            sum = sum_add(sum, Sum(vec4f(2.0 * abs(stretch), 4.0 * energy, 0.0, 0.0), vec4f(0.0)));
            let own = Extremes(stretch, triangle.particles.x, 0.0, NO_PARTICLE, 0u);
            extremes = extremes_merge(extremes, own);
        }
    }
    sum = tree_sum(thread, sum);
    extremes = tree_extremes(thread, extremes);
    if thread == 0u && first_block + block < model.measure_blocks {
        let at = (first_block + block) * MEASURE_WORDS;
        measure_partials[at] = bitcast<vec4<u32>>(sum.high);
        measure_partials[at + 1u] = bitcast<vec4<u32>>(sum.low);
        for (var k = 2u; k < 6u; k += 1u) {
            measure_partials[at + k] = vec4<u32>(0u);
        }
        let largest = vec4f(extremes.strain_max, 0.0, 0.0, 0.0);
        measure_partials[at + 6u] = bitcast<vec4<u32>>(largest);
        measure_partials[at + 7u] = vec4<u32>(extremes.strain_particle, NO_PARTICLE, 0u, 0u);
    }
}
