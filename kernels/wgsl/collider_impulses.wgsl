// NUMERICS section 7: sums of what colliders did, over blocks of particles, in a tree of fixed shape. What is
// summed starts again from zero. Workgroup number c b + k is for block k of b and collider c.
//!include model measure_sum

@group(0) @binding(55) var<storage, read_write> collider_impulses: array<vec4f>;
// Impulse, what it lost to rounding, moment, what that lost.
@group(0) @binding(56) var<storage, read_write> impulse_partials: array<vec4f>;

const PARTICLES_PER_THREAD: u32 = 4u;

@compute @workgroup_size(MEASURE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let number = workgroup.x + workgroup.y * groups.x;
    let collider = number / model.measure_blocks;
    let block = number % model.measure_blocks;
    let count = arrayLength(&collider_impulses) / (2u * model.particle_count);
    let zero = Sum(vec4f(0.0), vec4f(0.0));
    var linear = zero;
    var angular = zero;
    for (var k = 0u; k < PARTICLES_PER_THREAD; k += 1u) {
        let particle = (block * PARTICLES_PER_THREAD + k) * MEASURE_THREADS + thread;
        if particle < model.particle_count && collider < count {
            let at = 2u * (collider * model.particle_count + particle);
            linear = sum_add(linear, Sum(collider_impulses[at], vec4f(0.0)));
            angular = sum_add(angular, Sum(collider_impulses[at + 1u], vec4f(0.0)));
            collider_impulses[at] = vec4f(0.0);
            collider_impulses[at + 1u] = vec4f(0.0);
        }
    }
    linear = tree_sum(thread, linear);
    angular = tree_sum(thread, angular);
    if thread == 0u && collider < count {
        let at = 4u * number;
        impulse_partials[at] = linear.high;
        impulse_partials[at + 1u] = linear.low;
        impulse_partials[at + 2u] = angular.high;
        impulse_partials[at + 3u] = angular.low;
    }
}
