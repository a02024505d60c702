// All that comes before the iterations of an implicit substep without contact or colliders, in one pass over the
// particles: the forces of fields and air, `spring_linearise` by both ends of a spring, `implicit_assemble`,
// `preconditioner_build`, `linear_begin`, `linear_start` and `linear_residual` of the start at z, which is 0. It is made of
// the same functions.
//!include model substep status call motion links link_kinds vectors symmetric matrix matrix_diagonal
//!include field spring_factor assemble preconditioner preconditioner_block constraint_none filter solve solve_begin
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end
//!if air
//!include triangles air air_jacobian
//!end
//!if not air
//!include air_jacobian_none
//!end

// A spring and the particle at its other end.
struct Link {
    entry: vec2<u32>,
    kind: u32,
    word: vec4<u32>,
    position: vec3f,
    velocity: vec3f,
}

fn link_at(at: u32, particle: u32) -> Link {
    let entry = link_entries[at];
    let kind = link_kind(at);
    let other = particle + entry.x;
    return Link(entry, kind, spring_word(kind), position_in[other].xyz, velocity_in[other].xyz);
}

// The parts with this spring more, whose factor the particle with the smaller number keeps.
fn link_assemble(before: Parts, link: Link, particle: u32, position: vec3f, velocity: vec3f) -> Parts {
    let difference = link.position - position;
    let relative = link.velocity - velocity;
    let factor = spring_factor(link.kind, link.word, difference);
    if particle + link.entry.x > particle {
        factors[link.entry.y + particle] = factor;
    }
    let along = dot_product(factor.xyz, relative);
    return spring_assemble(before, factor, SpringPull(relative, difference, along, max(factor.w, 0.0)));
}

// B, D, b, P^-1, the solution at the start, r and c of a particle. Returns the terms of the sums of r . c and r . r.
fn particle_prepare(particle: u32) -> vec2f {
    let position = position_in[particle];
    let velocity = velocity_in[particle];
    var outer = field_force(velocity.w, velocity.xyz);
//!if air
    outer += air_force(particle);
//!end
    let base = base_of(velocity.w, air_jacobian(particle));
    var parts = Parts(Symmetric(vec3f(0.0), vec3f(0.0)), substep.length * outer);
    // Four at a time, so that the device waits once for what they read; what lies beyond the row is read again and left out.
    let row = link_row(particle);
    let last = row.end - row.stride;
    for (var at_a = row.first; at_a < row.end; at_a += 4u * row.stride) {
        let at_b = at_a + row.stride;
        let at_c = at_b + row.stride;
        let at_d = at_c + row.stride;
        let a = link_at(at_a, particle);
        let b = link_at(min(at_b, last), particle);
        let c = link_at(min(at_c, last), particle);
        let d = link_at(min(at_d, last), particle);
        parts = link_assemble(parts, a, particle, position.xyz, velocity.xyz);
        if at_b < row.end {
            parts = link_assemble(parts, b, particle, position.xyz, velocity.xyz);
        }
        if at_c < row.end {
            parts = link_assemble(parts, c, particle, position.xyz, velocity.xyz);
        }
        if at_d < row.end {
            parts = link_assemble(parts, d, particle, position.xyz, velocity.xyz);
        }
    }
    let kind = filter_kind_now(particle, position.w);
    system_set(particle, base, kind, parts);
    let block = Symmetric(base.on + parts.diagonal.on, base.off + parts.diagonal.off);
    preconditioner_set(particle, block);
    var start = vec3f(0.0);
    if call_has(CALL_FROM_SOLUTION) {
        start = filtered(particle, kind, vector_get(VECTOR_SOLUTION, particle));
    }
    vector_set(VECTOR_SOLUTION, particle, start);
    vector_set(VECTOR_DIRECTION, particle, vec3f(0.0));
    let residual = filtered(particle, kind, parts.right_side);
    let result = preconditioned(particle, kind, residual);
    vector_set(VECTOR_RESIDUAL, particle, residual);
    vector_set(VECTOR_PRECONDITIONED, particle, result);
    return vec2f(dot_product(residual, result), dot_product(residual, residual));
}

@compute @workgroup_size(SOLVE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.x + workgroup.y * groups.x;
    let is_stopped = is_stopped();
    if block == 0u && thread == 0u {
        solve_begin(!is_stopped);
        solve.current = solve.next;
    }
    var sum = vec2f(0.0);
    for (var k = 0u; k < model.solve_repeats; k += 1u) {
        let particle = (block * model.solve_repeats + k) * SOLVE_THREADS + thread;
        if particle < model.particle_count && !is_stopped {
            sum += particle_prepare(particle);
        }
    }
    let total = workgroup_sum(thread, sum);
    if thread == 0u && block < model.solve_blocks {
        partials[block] = total;
    }
}
