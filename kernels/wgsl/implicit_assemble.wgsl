// NUMERICS section 5: B, D and b.
//!include model substep status call motion force links link_kinds vectors symmetric matrix matrix_diagonal
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!include filter
//!if colliders
//!include constraint_change
//!end
//!if air
//!include triangles air air_jacobian
//!end
//!if not air
//!include air_jacobian_none
//!end
//!if penalty
@group(0) @binding(17) var<storage, read> contact_rows: array<vec2<u32>>;
@group(0) @binding(18) var<storage, read> contact_entries: array<u32>;
@group(0) @binding(45) var<storage, read> contact_factors: array<vec4f>;
//!end
@group(0) @binding(47) var<storage, read> velocity_kept: array<vec4f>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let position = position_in[particle];
    let velocity = velocity_in[particle];
    let iterates = call_has(CALL_ITERATE);
    let length = substep.length;
    let air = air_jacobian(particle);
    var base = Symmetric(
        fma(vec3f(length), air.on, velocity.w * (vec3f(1.0) + length * model.drag_rate)),
        length * air.off,
    );
    var right_side = length * force[particle].xyz;
    if iterates {
        right_side -= velocity.w * (velocity.xyz - velocity_kept[particle].xyz);
    }
    var diagonal = Symmetric(vec3f(0.0), vec3f(0.0));
    let row = link_row(particle);
    for (var at = row.first; at < row.end; at += row.stride) {
        let entry = link_entries[at];
        let other = particle + entry.x;
        let factor = factors[entry.y + particle];
        let u = factor.xyz;
        let relative = velocity_in[other].xyz - velocity.xyz;
        var along = dot_product(u, relative);
        let g = max(factor.w, 0.0);
        var across = g;
        if iterates {
            let damping = bitcast<f32>(spring_word(link_kind(at)).w);
            let square = dot_product(u, u);
            along = select(0.0, length * damping / square * along, square > 0.0);
            across = 0.0;
        }
        let difference = position_in[other].xyz - position.xyz;
        var pull = fma(vec3f(along), u, across * relative);
        pull = fma(vec3f(factor.w / length), difference, pull);
        right_side += pull;
        diagonal.on += vec3f(g);
        diagonal = symmetric_add_outer(diagonal, 1.0, u);
    }
//!if penalty
    let stiffness = length * model.contact_stiffness;
    let share = select(stiffness / (stiffness + model.contact_damping), 0.0, iterates);
    let pairs = contact_rows[particle];
    for (var at = pairs.x; at < pairs.x + pairs.y; at += 1u) {
        let factor = contact_factors[at];
        if factor.w != 0.0 {
            let relative = velocity_in[contact_entries[at]].xyz - velocity.xyz;
            let along = share * dot_product(factor.xyz, relative);
            right_side = add_scaled(right_side, along, factor.xyz);
            diagonal = symmetric_add_outer(diagonal, 1.0, factor.xyz);
        }
    }
//!end
//!if colliders
    if constraint_count(particle) > 0u {
        var constraint = constraints[particle];
        let drag = constraint_drag(&constraint, velocity.xyz);
        base.on += drag.plane.on;
        base.off += drag.plane.off;
        right_side -= drag.impulse;
    }
//!end
    let kind = filter_kind_now(particle, position.w);
    matrix_base[2u * particle] = vec4f(base.on, kind);
    matrix_base[2u * particle + 1u] = vec4f(base.off, 0.0);
    matrix_diagonal[2u * particle] = vec4f(base.on + diagonal.on, 0.0);
    matrix_diagonal[2u * particle + 1u] = vec4f(base.off + diagonal.off, 0.0);
    vector_set(VECTOR_RIGHT_SIDE, particle, right_side);
}
