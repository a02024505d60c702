// NUMERICS section 5, conjugate gradient, second half of an iteration: its scalars, then
// p = c + beta p, q = s + beta q, y += alpha p, r -= alpha q, c = S P^-1 r, and the sums of r . c and r . r.
//!include model call vectors symmetric matrix preconditioner solve solve_check solve_energy
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!include filter

@compute @workgroup_size(SOLVE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    var state = solve.current;
    if phase_uniform(thread, state.phase) != SOLVE_RUNNING {
        return;
    }
    let delta = partials_total(thread, PARTIALS_MAX).x;
    var beta = 0.0;
    var curvature = delta;
    if state.alpha_before != 0.0 {
        beta = state.gamma / state.gamma_before;
        curvature = fma(-(beta * state.gamma), 1.0 / state.alpha_before, delta);
    }
    let alpha = state.gamma / curvature;
    var phase = phase_after(state);
    if phase == SOLVE_RUNNING && !(curvature > 0.0 && is_number(alpha)) {
        phase = select(SOLVE_ENDED, SOLVE_BROKEN, state.iteration == 0u);
        if call_has(CALL_RESTARTS) {
            phase = SOLVE_INDEFINITE;
        }
    }
    phase = phase_uniform(thread, phase);
    if block == 0u && thread == 0u {
        state.phase = phase;
        if phase == SOLVE_RUNNING {
            state.iteration += 1u;
            state.alpha_before = alpha;
            state.gamma_before = state.gamma;
            if call_has(CALL_ENERGY) {
                state.energy = energy_add(alpha * state.gamma);
            }
        }
        solve.next = state;
    }
    if phase != SOLVE_RUNNING {
        return;
    }
    var sum = vec2f(0.0);
    for (var k = 0u; k < model.solve_repeats; k += 1u) {
        let particle = (block * model.solve_repeats + k) * SOLVE_THREADS + thread;
        if particle < model.particle_count {
            var direction = vector_get(VECTOR_PRECONDITIONED, particle);
            var image = vector_get(VECTOR_IMAGE, particle);
            if beta != 0.0 {
                direction = add_scaled(direction, beta, vector_get(VECTOR_DIRECTION, particle));
                image = add_scaled(image, beta, vector_get(VECTOR_DIRECTION_IMAGE, particle));
            }
            vector_set(VECTOR_DIRECTION, particle, direction);
            vector_set(VECTOR_DIRECTION_IMAGE, particle, image);
            let solution = vector_get(VECTOR_SOLUTION, particle);
            vector_set(VECTOR_SOLUTION, particle, add_scaled(solution, alpha, direction));
            let residual = add_scaled(vector_get(VECTOR_RESIDUAL, particle), -alpha, image);
            vector_set(VECTOR_RESIDUAL, particle, residual);
            if call_has(CALL_SCHWARZ) {
                continue;
            }
            let result = preconditioned(particle, filter_kind(particle), residual);
            vector_set(VECTOR_PRECONDITIONED, particle, result);
            sum += vec2f(dot_product(residual, result), dot_product(residual, residual));
        }
    }
    let total = workgroup_sum(thread, sum);
    if thread == 0u && block < model.solve_blocks {
        partials[block] = total;
    }
}
