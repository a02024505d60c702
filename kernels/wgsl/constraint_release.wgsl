// NUMERICS section 5: contacts that pull, slip, or slide with a drag that is not theirs. The image is A y.
//!include model status motion vectors symmetric matrix matrix_diagonal constraint constraint_change solve

// Friction this far from its value, relative to it, is corrected ...
const DRAG_ERROR: f32 = 0.1;
// ... if that is more than a free particle needs for this change of velocity [m/s].
const SLIP_ERROR: f32 = 3e-4;

const STANDS: u32 = 0u;
// Slides with this drag.
const DRAGS: u32 = 1u;
// Does not stick any more, but slides with this drag.
const SLIPS: u32 = 2u;
const PULLS: u32 = 3u;

struct Verdict {
    kind: u32,
    drag: f32,
}

struct Solved {
    impulse: vec3f,
    velocity: vec3f,
    mass: f32,
    inertia: Symmetric,
}

fn tangential(touch: Touch, vector: vec3f) -> vec3f {
    return add_scaled(vector, -dot_product(vector, touch.normal), touch.normal);
}

fn verdict_of(touch: Touch, solved: Solved) -> Verdict {
    let push = dot_product(solved.impulse, touch.normal);
    if push < 0.0 {
        return Verdict(PULLS, 0.0);
    }
    let grip = touch.friction * push;
    if touch.sticks != 0u {
        let along = tangential(touch, solved.impulse);
        let size = sqrt(dot_product(along, along));
        if size <= grip {
            return Verdict(STANDS, 0.0);
        }
        let direction = along / max(size, LENGTH_MIN);
        // What the drag is if nothing but this particle starts to move.
        let inertia = dot_product(direction, symmetric_apply(solved.inertia, direction));
        return Verdict(SLIPS, grip * inertia / (size - grip));
    }
    let slide = tangential(touch, solved.velocity - touch.surface);
    let slip = max(sqrt(dot_product(slide, slide)), SLIP_MIN);
    let drag = grip / slip;
    let error = abs(drag - touch.drag) * slip;
    if error > max(DRAG_ERROR * grip, solved.mass * SLIP_ERROR) {
        return Verdict(DRAGS, drag);
    }
    return Verdict(STANDS, 0.0);
}

// Whether anything changed.
fn release(constraint: ptr<function, Constraint>, solved: Solved) -> bool {
    var changed = false;
    for (var left = (*constraint).count; left > 0u; left -= 1u) {
        let index = left - 1u;
        let verdict = verdict_of((*constraint).touches[index], solved);
        if verdict.kind == DRAGS {
            (*constraint).touches[index].drag = verdict.drag;
            changed = true;
        }
        if verdict.kind == SLIPS {
            (*constraint).touches[index].sticks = 0u;
            (*constraint).touches[index].drag = verdict.drag;
            constraint_update(constraint);
            return true;
        }
        if verdict.kind == PULLS {
            for (var k = left; k < (*constraint).count; k += 1u) {
                (*constraint).touches[k - 1u] = (*constraint).touches[k];
            }
            (*constraint).count -= 1u;
            constraint_update(constraint);
            return true;
        }
    }
    return changed;
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() || solve.next.phase == SOLVE_SKIPPED {
        return;
    }
    if constraint_count(particle) == 0u {
        return;
    }
    let velocity = velocity_in[particle];
    let right_side = vector_get(VECTOR_RIGHT_SIDE, particle);
    let solved = Solved(
        vector_get(VECTOR_IMAGE, particle) - right_side,
        velocity.xyz + vector_get(VECTOR_SOLUTION, particle),
        velocity.w,
        matrix_diagonal_get(particle),
    );
    var constraint = constraints[particle];
    let before = constraint_drag(&constraint, velocity.xyz);
    if !release(&constraint, solved) {
        return;
    }
    let after = constraint_drag(&constraint, velocity.xyz);
    constraints[particle] = constraint;
    let on = after.plane.on - before.plane.on;
    let off = after.plane.off - before.plane.off;
    let base = matrix_base[2u * particle];
    matrix_base[2u * particle] = vec4f(base.xyz + on, base.w);
    matrix_base[2u * particle + 1u] += vec4f(off, 0.0);
    matrix_diagonal[2u * particle] += vec4f(on, 0.0);
    matrix_diagonal[2u * particle + 1u] += vec4f(off, 0.0);
    vector_set(VECTOR_RIGHT_SIDE, particle, right_side - (after.impulse - before.impulse));
    atomicAdd(&solve.changed, 1u);
    atomicAdd(&solve.released, 1u);
}
