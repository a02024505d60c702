// NUMERICS section 10: figures of a state, over blocks of particles.
//!include model substep motion finite spring collider measure_sum feedback_none
//!if grids
//!include distance_grid
//!end
//!if not grids
//!include distance_grid_none
//!end
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end
//!if contact
@group(0) @binding(19) var<storage, read> contact_counts: array<u32>;
//!end

// The results of each block, MEASURE_WORDS each.
@group(0) @binding(30) var<storage, read_write> measure_partials: array<vec4<u32>>;

const PARTICLES_PER_THREAD: u32 = 4u;

struct Figures {
    // Sums of |strain|, of twice the energy of springs, of |tension|; kinetic energy.
    first: vec4f,
    // Momentum; potential energy.
    second: vec4f,
    // Sum of all spring forces.
    third: vec4f,
    extremes: Extremes,
}

fn figures_of(particle: u32) -> Figures {
    let position = position_in[particle];
    let velocity = velocity_in[particle];
    let mass = velocity.w;
    var extremes = extremes_none();
    extremes.strain_particle = particle;
    var strain_sum = 0.0;
    var elastic = 0.0;
    var magnitude = 0.0;
    var total = vec3f(0.0);
    let row = spring_row(particle);
    for (var at = row.first; at < row.end; at += row.stride) {
        let spring = spring_at(at, particle, position.xyz, velocity.xyz);
        let strain = spring.stretch / spring.rest_length;
        extremes.strain_max = max(extremes.strain_max, select(-1.0, strain, spring_is_measured(at)));
        strain_sum += abs(strain);
        elastic += elastic_energy_doubled(at, spring.stiffness, spring.stretch);
        magnitude += abs(spring.tension);
        total = add_scaled(total, spring.tension * spring.inverse_length, spring.difference);
    }
    if !(is_finite(position.xyz) && is_finite(velocity.xyz)) {
        extremes.non_finite = particle;
    }
    if position.w > 0.0 {
        extremes.penetration = penetration(cloth_offset(particle), position.xyz);
    }
//!if contact
    extremes.contacts = contact_counts[particle];
//!end
    let kinetic = 0.5 * (mass * dot_product(velocity.xyz, velocity.xyz));
    let potential = -(mass * dot_product(model.acceleration, position.xyz));
    return Figures(
        vec4f(strain_sum, elastic, magnitude, kinetic),
        vec4f(mass * velocity.xyz, potential),
        vec4f(total, 0.0),
        extremes,
    );
}

@compute @workgroup_size(MEASURE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    let zero = Sum(vec4f(0.0), vec4f(0.0));
    var first = zero;
    var second = zero;
    var third = zero;
    var extremes = extremes_none();
    for (var k = 0u; k < PARTICLES_PER_THREAD; k += 1u) {
        let particle = (block * PARTICLES_PER_THREAD + k) * MEASURE_THREADS + thread;
        if particle < model.particle_count {
            let figures = figures_of(particle);
            first = sum_add(first, Sum(figures.first, vec4f(0.0)));
            second = sum_add(second, Sum(figures.second, vec4f(0.0)));
            third = sum_add(third, Sum(figures.third, vec4f(0.0)));
            extremes = extremes_merge(extremes, figures.extremes);
        }
    }
    first = tree_sum(thread, first);
    second = tree_sum(thread, second);
    third = tree_sum(thread, third);
    extremes = tree_extremes(thread, extremes);
    if thread == 0u && block * PARTICLES_PER_THREAD * MEASURE_THREADS < model.particle_count {
        let at = block * MEASURE_WORDS;
        measure_partials[at] = bitcast<vec4<u32>>(first.high);
        measure_partials[at + 1u] = bitcast<vec4<u32>>(first.low);
        measure_partials[at + 2u] = bitcast<vec4<u32>>(second.high);
        measure_partials[at + 3u] = bitcast<vec4<u32>>(second.low);
        measure_partials[at + 4u] = bitcast<vec4<u32>>(third.high);
        measure_partials[at + 5u] = bitcast<vec4<u32>>(third.low);
        let particles = vec3<u32>(extremes.strain_particle, extremes.non_finite, extremes.contacts);
        measure_partials[at + 6u] = bitcast<vec4<u32>>(vec4f(extremes.strain_max, extremes.penetration, 0.0, 0.0));
        measure_partials[at + 7u] = vec4<u32>(particles, 0u);
    }
}
