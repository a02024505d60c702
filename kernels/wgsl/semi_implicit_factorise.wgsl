// NUMERICS section 6: the constant matrix W, in the form of that of section 5: a spring has u = 0 and its weight
// as e. The blocks of triangles of fabric are there already.
//!include model status call motion links link_kinds symmetric matrix matrix_diagonal
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end
//!if fabric
//!include element_sums element_own
//!end
//!if not fabric
//!include element_own_none
//!end

// The least mass of a particle, as a share of the sum of its springs and triangles.
const MASS_SHARE_MIN: f32 = 1e-12;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let length = call.amount;
    let of_fabric = element_own(particle);
    var weights = of_fabric;
    let row = link_row(particle);
    for (var at = row.first; at < row.end; at += row.stride) {
        let entry = link_entries[at];
        let numbers = bitcast<vec4f>(spring_word(link_kind(at)));
        let weight = fma(length * length, numbers.z, length * numbers.w);
        weights += weight;
        if particle + entry.x > particle {
            factors[entry.y + particle] = vec4f(0.0, 0.0, 0.0, weight);
        }
    }
    let mass = max(velocity_in[particle].w, MASS_SHARE_MIN * weights);
    let kind = select(FILTER_HELD, FILTER_FREE, position_in[particle].w > 0.0);
    matrix_base[2u * particle] = vec4f(vec3f(mass), kind);
    matrix_base[2u * particle + 1u] = vec4f(0.0);
    matrix_diagonal[2u * particle] = vec4f(vec3f(mass + weights), 0.0);
    matrix_diagonal[2u * particle + 1u] = vec4f(0.0);
}
