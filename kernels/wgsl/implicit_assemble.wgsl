// NUMERICS section 5: B, D and b.
//!include model substep status call motion force links link_kinds vectors symmetric matrix matrix_diagonal
//!include assemble
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
//!if triangles
//!include contact_table
//!end
//!if fabric
//!include element_sums
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
    var base = base_of(velocity.w, air);
    var parts = Parts(Symmetric(vec3f(0.0), vec3f(0.0)), length * force[particle].xyz);
//!if fabric
    parts.diagonal = Symmetric(element_sums[3u * particle].xyz, element_sums[3u * particle + 1u].xyz);
    parts.right_side += element_sums[3u * particle + 2u].xyz;
//!end
    if iterates {
        parts.right_side -= velocity.w * (velocity.xyz - velocity_kept[particle].xyz);
    }
    let row = link_row(particle);
    for (var at = row.first; at < row.end; at += row.stride) {
        let entry = link_entries[at];
        let other = particle + entry.x;
        let factor = factors[entry.y + particle];
        let u = factor.xyz;
        let relative = velocity_in[other].xyz - velocity.xyz;
        var along = dot_product(u, relative);
        var across = max(factor.w, 0.0);
        if iterates {
            let damping = bitcast<f32>(spring_word(link_kind(at)).w);
            let square = dot_product(u, u);
            along = select(0.0, length * damping / square * along, square > 0.0);
            across = 0.0;
        }
        let difference = position_in[other].xyz - position.xyz;
        let pull = SpringPull(relative, difference, along, across);
        parts = spring_assemble(parts, factor, pull);
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
            parts.right_side = add_scaled(parts.right_side, along, factor.xyz);
            parts.diagonal = symmetric_add_outer(parts.diagonal, 1.0, factor.xyz);
        }
    }
//!end
//!if triangles
    let places = contact_places(particle);
    for (var k = places.x; k < places.y; k += 1u) {
        let place = contact_table[k];
        let at = contact_of(place);
        let weight = contact_weight(at, place);
        let rows = Symmetric(contact_three(at + 8u), contact_three(at + 11u));
        parts.diagonal.on += weight * weight * rows.on;
        parts.diagonal.off += weight * weight * rows.off;
        if contact_table[1] != 0u {
            var relative = vec3f(0.0);
            for (var b = 0u; b < 4u; b += 1u) {
                relative = add_scaled(relative, contact_number(at + 4u + b), velocity_in[contact_table[at + b]].xyz);
            }
            parts.right_side -= weight * (symmetric_apply(rows, relative) + contact_three(at + 17u));
        }
    }
//!end
//!if colliders
    if constraint_count(particle) > 0u {
        var constraint = constraints[particle];
        let drag = constraint_drag(&constraint, velocity.xyz);
        base.on += drag.plane.on;
        base.off += drag.plane.off;
        parts.right_side -= drag.impulse;
    }
//!end
    system_set(particle, base, filter_kind_now(particle, position.w), parts);
}
