// NUMERICS section 5, conjugate gradient, a whole iteration for models of few particles, where the start of a
// kernel costs more than its work: that of `conjugate_gradient_step`, then that of `conjugate_gradient_image` for
// the next iteration. Both need sums over all particles, which are there when the kernel starts; the image needs c
// of particles of other workgroups too, which is computed again. So what neighbours read has two copies that
// take turns. The arithmetic is that of the two kernels.
//!include model call vectors symmetric links matrix preconditioner matrix_entry matrix_springs solve solve_check
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!include filter

// Particles around those of a workgroup, by their numbers, whose c is kept: as many on either side as
// springs reach. The host does not use this kernel where they reach further.
const WINDOW: u32 = 1024u;
var<workgroup> window: array<f32, 3 * WINDOW>;

// A particle before the iteration.
struct Before {
    residual: vec3f,
    image: vec3f,
    direction_image: vec3f,
    inverse: vec4f,
    kind: f32,
}

// The vectors that are read, and those that are written instead.
struct Copies {
    residual: u32,
    image: u32,
    direction_image: u32,
}

struct Scalars {
    alpha: f32,
    beta: f32,
}

fn copies_of(is_odd: bool) -> Copies {
    if is_odd {
        return Copies(VECTOR_RESIDUAL_ODD, VECTOR_IMAGE_ODD, VECTOR_DIRECTION_IMAGE_ODD);
    }
    return Copies(VECTOR_RESIDUAL, VECTOR_IMAGE, VECTOR_DIRECTION_IMAGE);
}

fn before_of(copies: Copies, particle: u32) -> Before {
    return Before(
        vector_get(copies.residual, particle),
        vector_get(copies.image, particle),
        vector_get(copies.direction_image, particle),
        inverse[2u * particle],
        filter_kind(particle),
    );
}

// q
fn direction_image_of(before: Before, scalars: Scalars) -> vec3f {
    if scalars.beta != 0.0 {
        return add_scaled(before.image, scalars.beta, before.direction_image);
    }
    return before.image;
}

fn window_set(at: u32, value: vec3f) {
    window[3u * at] = value.x;
    window[3u * at + 1u] = value.y;
    window[3u * at + 2u] = value.z;
}

// c by its place in the window, for rows of A.
fn row_vector(place: u32) -> vec3f {
    return vec3f(window[3u * place], window[3u * place + 1u], window[3u * place + 2u]);
}

// Number of the particle beside those of a workgroup from `first` on, in either direction.
fn beside(first: u32, number: u32) -> u32 {
    return first - call.reach + number + select(0u, SOLVE_THREADS, number >= call.reach);
}

// Keeps c of such a particle.
fn beside_keep(first: u32, number: u32, before: Before, scalars: Scalars) {
    let particle = beside(first, number);
    if number >= 2u * call.reach || particle >= model.particle_count {
        return;
    }
    let residual = add_scaled(before.residual, -scalars.alpha, direction_image_of(before, scalars));
    let result = preconditioned_by(before.inverse, particle, before.kind, residual);
    window_set(particle + call.reach - first, result);
}

// The sums over all threads, for all of them, in the tree of `workgroup_sum`. They lie in the window, which is to be
// filled after the next barrier only.
fn workgroup_sums(thread: u32, own: vec3f) -> vec3f {
    workgroupBarrier();
    sums[thread] = own.xy;
    window[thread] = own.z;
    for (var quarter = SOLVE_THREADS / 4u; quarter > 0u; quarter /= 4u) {
        workgroupBarrier();
        if thread < quarter {
            let first = sums[thread] + sums[thread + quarter];
            sums[thread] = first + (sums[thread + 2u * quarter] + sums[thread + 3u * quarter]);
            let third = window[thread] + window[thread + quarter];
            window[thread] = third + (window[thread + 2u * quarter] + window[thread + 3u * quarter]);
        }
    }
    workgroupBarrier();
    return vec3f(sums[0], window[0]);
}

// The sums of all blocks, gamma, r . r and delta, from place `first` on: `partials_total` for both of them.
fn partials_totals(thread: u32, first: u32) -> vec3f {
    var own = vec3f(0.0);
    for (var block = thread; block < model.solve_blocks; block += SOLVE_THREADS) {
        own += vec3f(partials[first + block], partials[first + PARTIALS_MAX + block].x);
    }
    return workgroup_sums(thread, own);
}

@compute @workgroup_size(SOLVE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    let first = block * SOLVE_THREADS;
    let particle = first + thread;
    let count = model.particle_count;
    let is_odd = call_has(CALL_ODD);
    let read = copies_of(is_odd);
    let written = copies_of(!is_odd);
    // All that is read of vectors at once, as each wait costs more than what is not needed.
    let own = min(particle, count - 1u);
    let before = before_of(read, own);
    let before_a = before_of(read, min(beside(first, thread), count - 1u));
    let before_b = before_of(read, min(beside(first, thread + SOLVE_THREADS), count - 1u));
    let before_c = before_of(read, min(beside(first, thread + 2u * SOLVE_THREADS), count - 1u));
    var direction = vector_get(VECTOR_PRECONDITIONED, own);
    let direction_before = vector_get(VECTOR_DIRECTION, own);
    let solution = vector_get(VECTOR_SOLUTION, own);
    var state = solve.next;
    if is_odd {
        state = solve.current;
    }
    let total = partials_totals(thread, select(0u, PARTIALS_ODD, is_odd));
    var scalars = Scalars(0.0, 0.0);
    if state.phase == SOLVE_RUNNING {
        state.gamma = total.x;
        state.residual = total.y;
        if state.reference < 0.0 {
            state.reference = total.y;
        }
        var curvature = total.z;
        if state.alpha_before != 0.0 {
            scalars.beta = state.gamma / state.gamma_before;
            curvature = fma(-(scalars.beta * state.gamma), 1.0 / state.alpha_before, total.z);
        }
        scalars.alpha = state.gamma / curvature;
        state.phase = phase_after(state);
        if state.phase == SOLVE_RUNNING && !(curvature > 0.0 && is_number(scalars.alpha)) {
            state.phase = select(SOLVE_ENDED, SOLVE_BROKEN, state.iteration == 0u);
            if call_has(CALL_RESTARTS) {
                state.phase = SOLVE_INDEFINITE;
            }
        }
        if state.phase == SOLVE_RUNNING {
            state.iteration += 1u;
            state.alpha_before = scalars.alpha;
            state.gamma_before = state.gamma;
        }
    }
    if block == 0u && thread == 0u {
        if is_odd {
            solve.next = state;
        } else {
            solve.current = state;
        }
    }
    if phase_uniform(thread, state.phase) != SOLVE_RUNNING {
        return;
    }
    var sum = vec3f(0.0);
    var result = vec3f(0.0);
    let is_there = particle < count;
    if is_there {
        if scalars.beta != 0.0 {
            direction = add_scaled(direction, scalars.beta, direction_before);
        }
        let direction_image = direction_image_of(before, scalars);
        let residual = add_scaled(before.residual, -scalars.alpha, direction_image);
        result = preconditioned_by(before.inverse, particle, before.kind, residual);
        vector_set(VECTOR_DIRECTION, particle, direction);
        vector_set(written.direction_image, particle, direction_image);
        vector_set(VECTOR_SOLUTION, particle, add_scaled(solution, scalars.alpha, direction));
        vector_set(written.residual, particle, residual);
        vector_set(VECTOR_PRECONDITIONED, particle, result);
        window_set(thread + call.reach, result);
        sum = vec3f(dot_product(residual, result), dot_product(residual, residual), 0.0);
    }
    beside_keep(first, thread, before_a, scalars);
    beside_keep(first, thread + SOLVE_THREADS, before_b, scalars);
    beside_keep(first, thread + 2u * SOLVE_THREADS, before_c, scalars);
    workgroupBarrier();
    if is_there {
        let image = filtered(particle, before.kind, matrix_springs(particle, thread + call.reach, result));
        vector_set(written.image, particle, image);
        sum.z = dot_product(result, image);
    }
    let totals = workgroup_sums(thread, sum);
    if thread == 0u && block < model.solve_blocks {
        let partials_to = select(PARTIALS_ODD, 0u, is_odd);
        partials[partials_to + block] = totals.xy;
        partials[partials_to + PARTIALS_MAX + block] = vec2f(totals.z, 0.0);
    }
}
